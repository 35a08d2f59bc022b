// The thread of a server.
#pragma once

namespace bslam::web_server {

// Lowers the priority of the calling thread (nice 10). On Linux only; a failure only affects the speed and is ignored.
void lower_priority();

// Processor time of the calling thread in ms. Time in which other threads run is not included.
double thread_ms();

}  // namespace bslam::web_server
