// The thread of a server.
#pragma once

namespace bslam::web_server {

// Gives the calling thread the time that others leave. On Linux only; a failure has no consequences but for the speed.
void lower_priority();

// Processor time of the calling thread in ms: the time in which others run does not count.
double thread_ms();

}  // namespace bslam::web_server
