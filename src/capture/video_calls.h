// The system calls by which a V4L2 camera is used, so that tests can stand in for the kernel.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace bslam::capture {

// Return values and errno are those of the calls of the same name.
class VideoCalls {
 public:
  virtual ~VideoCalls() = default;

  virtual int open(const char* path) = 0;  // for reading and writing, without blocking
  virtual int close(int device) = 0;
  virtual int ioctl(int device, unsigned long request, void* argument) = 0;
  virtual void* mmap(int device, std::size_t length, std::int64_t offset) = 0;  // MAP_FAILED on error
  virtual int munmap(void* memory, std::size_t length) = 0;
  // Waits until an image can be fetched: as poll() with POLLIN.
  virtual int poll(int device, std::chrono::milliseconds timeout) = 0;
  // The paths of the video devices of the machine, /dev/video0 and so on, in order of their numbers.
  virtual std::vector<std::string> devices() = 0;
};

// Those of the kernel.
VideoCalls& system_calls();

}  // namespace bslam::capture
