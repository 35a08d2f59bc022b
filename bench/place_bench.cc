// Place recognition at full size: the shipped vocabulary, frames of 2,000 words, a map of 2,000 keyframes.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "base/random.h"
#include "place/inverted_index.h"
#include "place/shipped_vocabulary.h"
#include "place/train.h"

namespace bslam::place {
namespace {

const Vocabulary& vocabulary() {
  static const VocabularyPtr shipped = shipped_vocabulary().value();
  return *shipped;
}

// Descriptors close to nodes of the tree, like those of images.
std::vector<feature::Descriptor> descriptors(std::size_t count, Random& random) {
  const auto& centres = vocabulary().content().descriptor;
  std::vector<feature::Descriptor> result(count);
  for (feature::Descriptor& d : result) {
    d = centres[random.below(static_cast<std::uint32_t>(centres.size()))];
    for (int i = 0; i < 25; ++i) d[random.below(4)] ^= std::uint64_t{1} << random.below(64);
  }
  return result;
}

std::shared_ptr<const WordVector> frame(Random& random) {
  const auto d = descriptors(2000, random);
  std::vector<WordId> words(d.size());
  vocabulary().words(d, words);
  return std::make_shared<const WordVector>(vocabulary(), words);
}

void LoadVocabulary(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(shipped_vocabulary().value()->size());
}
BENCHMARK(LoadVocabulary)->Unit(benchmark::kMillisecond);

void LookUpWords(benchmark::State& state) {
  Random random(1);
  const auto d = descriptors(100000, random);
  std::vector<WordId> words(2000);
  std::size_t at = 0;
  for (auto _ : state) {
    vocabulary().words(std::span(d).subspan(at, words.size()), words);
    at = (at + words.size()) % d.size();
    benchmark::DoNotOptimize(words.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(words.size()));
}
BENCHMARK(LookUpWords)->Unit(benchmark::kMicrosecond);

void MakeWordVector(benchmark::State& state) {
  Random random(2);
  const auto d = descriptors(2000, random);
  std::vector<WordId> words(d.size());
  vocabulary().words(d, words);
  for (auto _ : state) benchmark::DoNotOptimize(WordVector(vocabulary(), words).size());
}
BENCHMARK(MakeWordVector)->Unit(benchmark::kMicrosecond);

void ScoreWordVectors(benchmark::State& state) {
  Random random(3);
  const auto a = frame(random), b = frame(random);
  for (auto _ : state) benchmark::DoNotOptimize(l1_score(*a, *b));
}
BENCHMARK(ScoreWordVectors)->Unit(benchmark::kMicrosecond);

void QueryIndex(benchmark::State& state) {
  Random random(4);
  InvertedIndex index;
  for (int k = 0; k < 2000; ++k) index.add(KeyframeId(k), frame(random));
  const auto query = frame(random);
  std::size_t found = 0;
  for (auto _ : state) found = index.query(*query).size();
  state.counters["keyframes"] = static_cast<double>(found);
}
BENCHMARK(QueryIndex)->Unit(benchmark::kMicrosecond);

void Train(benchmark::State& state) {
  Random random(5);
  std::vector<std::vector<feature::Descriptor>> images(50);
  for (auto& image : images) image = descriptors(1000, random);
  ThreadPool pool(1);
  for (auto _ : state) benchmark::DoNotOptimize(train_vocabulary(images, {}, random, pool).value()->size());
}
BENCHMARK(Train)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace bslam::place
