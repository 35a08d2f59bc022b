#include "capture/video_calls.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

namespace bslam::capture {
namespace {

class SystemCalls final : public VideoCalls {
 public:
  int open(const char* path) override { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); }
  int close(int device) override { return ::close(device); }
  int ioctl(int device, unsigned long request, void* argument) override { return ::ioctl(device, request, argument); }
  void* mmap(int device, std::size_t length, std::int64_t offset) override {
    return ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, device, offset);
  }
  int munmap(void* memory, std::size_t length) override { return ::munmap(memory, length); }
  int poll(int device, std::chrono::milliseconds timeout) override {
    pollfd wait{device, POLLIN, 0};
    return ::poll(&wait, 1, static_cast<int>(timeout.count()));
  }
  std::vector<std::string> devices() override {
    std::vector<std::string> out;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("video") && name.size() > 5 && name.find_first_not_of("0123456789", 5) == std::string::npos)
        out.push_back(entry.path().string());
    }
    std::ranges::sort(out, [](const std::string& a, const std::string& b) {
      return a.size() != b.size() ? a.size() < b.size() : a < b;
    });
    return out;
  }
};

}  // namespace

VideoCalls& system_calls() {
  static SystemCalls calls;
  return calls;
}

}  // namespace bslam::capture
