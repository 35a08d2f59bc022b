// Runs a target on mutations of its seeds, for compilers without libFuzzer. If the program is instrumented, inputs that
// reach new edges are added to the corpus. The same seed and number of runs give the same inputs.
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "base/random.h"
#include "coverage.h"
#include "mutation.h"
#include "target.h"

// Options of the sanitizers, if the program is built with them. This file is not instrumented, since the sanitizers ask
// for their options before they are initialised.
extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));
// Inputs have at most 64 KB, so a reader that allocates a gigabyte uses a number that it should check.
extern "C" const char* __asan_default_options();
extern "C" const char* __ubsan_default_options();
const char* __asan_default_options() { return "max_allocation_size_mb=1024:allocator_may_return_null=0"; }
const char* __ubsan_default_options() { return "print_stacktrace=1:halt_on_error=1"; }

namespace bslam::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr int kSlowSeconds = 20;  // an input that takes longer is reported as a hang
constexpr std::size_t kMaxCorpus = 4000;

struct Arguments {
  long seconds = 60, runs = -1;
  std::uint64_t seed = 1;
  fs::path crash = "crash", write_seeds;
  std::vector<fs::path> inputs;
};

// The current input, for the handlers below.
std::string current;
std::string crash_file;

void keep_current() {
  std::ofstream(crash_file, std::ios::binary).write(current.data(), static_cast<std::streamsize>(current.size()));
  std::fprintf(stderr, "fuzz: the input is in %s\n", crash_file.c_str());
}

void on_signal(int number) {
  if (number == SIGPROF) std::fprintf(stderr, "fuzz: an input took more than %d s\n", kSlowSeconds);
  keep_current();
  ::_exit(1);
}

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const auto value = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (name == "--seconds") {
      a.seconds = std::atol(value().c_str());
    } else if (name == "--runs") {
      a.runs = std::atol(value().c_str());
    } else if (name == "--seed") {
      a.seed = std::strtoull(value().c_str(), nullptr, 10);
    } else if (name == "--crash") {
      a.crash = value();
    } else if (name == "--write-seeds") {
      a.write_seeds = value();
    } else if (name.starts_with("--")) {
      std::fprintf(stderr,
                   "usage: %s [--seconds S] [--runs N] [--seed N] [--crash FILE] [--write-seeds DIR] [INPUT...]\n",
                   argv[0]);
      std::exit(2);
    } else {
      a.inputs.emplace_back(name);
    }
  }
  return a;
}

// Limits processor time, so that a busy machine is not reported as a hang. 0: no limit.
void limit_time(int seconds) {
  itimerval limit{};
  limit.it_value.tv_sec = seconds;
  ::setitimer(ITIMER_PROF, &limit, nullptr);
}

std::size_t run(const std::string& input) {
  current = input;
  limit_time(kSlowSeconds);
  begin_coverage();
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
  const std::size_t fresh = new_places();
  limit_time(0);
  return fresh;
}

void search(const Arguments& a, std::vector<std::string> corpus) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(a.seconds);
  std::size_t places = 0;
  double longest_ms = 0;
  long runs = 0;
  for (const std::string& input : corpus) places += run(input);
  if (corpus.empty()) corpus.emplace_back();
  Random random(a.seed, "fuzz");
  for (; a.runs >= 0 ? runs < a.runs : Clock::now() < end; ++runs) {
    // Prefers the newest inputs, which were mutated least often.
    const std::size_t n = corpus.size(), newest = std::min<std::size_t>(n, 50);
    const std::size_t pick = random.below(2) == 0 ? random.below(static_cast<std::uint32_t>(n))
                                                  : n - 1 - random.below(static_cast<std::uint32_t>(newest));
    std::string input = mutate(corpus[pick], corpus, random);
    const std::clock_t begin = std::clock();
    const std::size_t fresh = run(input);
    longest_ms = std::max(longest_ms, 1000.0 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    places += fresh;
    if (fresh > 0 && corpus.size() < kMaxCorpus) corpus.push_back(std::move(input));
  }
  std::printf("%ld inputs, %zu kept, %zu edges reached, slowest %.0f ms\n", runs, corpus.size(), places, longest_ms);
}

int main_of(int argc, char** argv) {
  const Arguments a = parse(argc, argv);
  crash_file = a.crash.string();
  for (const int number : {SIGABRT, SIGPROF}) ::signal(number, on_signal);
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(keep_current);
  if (!a.write_seeds.empty()) {
    fs::create_directories(a.write_seeds);
    std::size_t n = 0;
    for (const std::string& s : seeds()) {
      std::ofstream(a.write_seeds / std::to_string(n++), std::ios::binary)
          .write(s.data(), static_cast<std::streamsize>(s.size()));
    }
    return 0;
  }
  if (!a.inputs.empty()) {  // only these inputs, once each
    for (const fs::path& file : a.inputs) run(slurp(file));
    return 0;
  }
  search(a, seeds());
  return 0;
}

}  // namespace
}  // namespace bslam::fuzz

int main(int argc, char** argv) { return bslam::fuzz::main_of(argc, argv); }
