// Where a library's words go: a sink the caller hands in. Nothing is printed by default.
#pragma once

#include <functional>
#include <string_view>

namespace bslam {

enum class LogLevel { kInfo, kWarning };

// Called with a level, the stage that speaks and one line without its end; empty = silent.
using LogSink = std::function<void(LogLevel, std::string_view stage, std::string_view line)>;

}  // namespace bslam
