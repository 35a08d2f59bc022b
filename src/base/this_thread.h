// The calling thread: its priority and processor time.
#pragma once

namespace bslam {

// Lowers the priority of the calling thread (nice 10). On Linux only; a failure only affects the speed and is ignored.
void lower_thread_priority();

// Processor time of the calling thread in ms. Time in which other threads run is not included.
double thread_ms();

}  // namespace bslam
