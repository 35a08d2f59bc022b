// Log output: libraries write to a sink supplied by the caller. Nothing is printed by default.
#pragma once

#include <functional>
#include <string_view>

namespace bslam {

enum class LogLevel { kInfo, kWarning };

// Receives the level, the name of the stage, and one line of text without a newline. An empty sink discards everything.
using LogSink = std::function<void(LogLevel, std::string_view stage, std::string_view line)>;

}  // namespace bslam
