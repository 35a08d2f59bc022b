// bslam vocab: trains and describes vocabularies for place recognition.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/cores.h"
#include "base/output_file.h"
#include "cli/print_message.h"
#include "cli/progress_bar.h"
#include "cli/verbs.h"
#include "dataset/training_images.h"
#include "feature/extractor.h"
#include "place/shipped_vocabulary.h"
#include "place/train.h"
#include "place/vocabulary_bytes.h"
#include "storage/vocabulary_file.h"

namespace bslam::cli {
namespace {

struct VocabTrainArguments {
  std::vector<std::string> images;
  std::string out, progress = "auto";
  place::TrainingOptions training;
  feature::FeatureOptions features;
  std::uint64_t seed = 1;
  int max_side = 1024, threads = 0;
  bool overwrite = false;
};

// Returns the descriptors of an image. The extractor requires a camera model, so a pinhole camera of the image size is
// used.
std::vector<feature::Descriptor> describe(const image::Image& image, feature::Extractor& extractor) {
  const double focal = std::max(image.width(), image.height());
  camera::Camera camera{.name = "any",
                        .model = camera::Pinhole({focal, focal, 0.5 * image.width(), 0.5 * image.height()}),
                        .width = image.width(),
                        .height = image.height(),
                        .time_offset_ns = 0,
                        .mask_file = {}};
  image::Pyramid pyramid;
  feature::Detections keypoints;
  extractor.extract(image.view(), {}, camera, pyramid, keypoints);
  return keypoints.descriptor;
}

struct TrainingSet {
  std::vector<std::vector<feature::Descriptor>> images;  // the images that could be read
  std::size_t skipped = 0, descriptors = 0;
};

// Every thread has its own extractor. The results are in the order of the files.
TrainingSet extract_all(const std::vector<std::filesystem::path>& files, const VocabTrainArguments& a,
                        ThreadPool& pool) {
  std::vector<std::optional<std::vector<feature::Descriptor>>> found(files.size());
  std::vector<std::string> warnings(files.size());
  ProgressBar bar(a.progress == "auto", "images");
  std::mutex mutex;
  std::size_t done = 0;
  const auto shares = static_cast<std::size_t>(pool.size());
  pool.for_each(shares, [&](std::size_t share) {
    feature::Extractor extractor(a.features);
    for (std::size_t i = share; i < files.size(); i += shares) {
      const auto image = dataset::read_training_image(files[i], a.max_side);
      if (image) {
        found[i] = describe(*image, extractor);
      } else {
        warnings[i] = image.error().message();
      }
      const std::lock_guard lock(mutex);
      bar.show(++done, files.size());
    }
  });
  bar.finish();
  TrainingSet set;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (found[i]) {
      set.descriptors += found[i]->size();
      set.images.push_back(std::move(*found[i]));
    } else {
      ++set.skipped;
      print_message("warning: {}; the image is skipped\n", warnings[i]);
    }
  }
  return set;
}

// Checks the output file before the training, which takes long. No image is replaced.
Status check_output(const VocabTrainArguments& a, const std::vector<std::filesystem::path>& images) {
  if (Status s = check_not_input(a.out, "--out", images); !s) return s;
  return check_output_file(a.out, "--out", a.overwrite, place::kVocabularyBegin);
}

int run_train(const VocabTrainArguments& a) {
  const auto files = dataset::find_images(a.images);
  if (!files) return report_error(files.error());
  if (const Status s = check_output(a, *files); !s) return report_error(s.error());
  if (files->empty())
    return report_error({a.images.front(), "", "no images", "PNG, JPEG, WebP, PNM, BMP or TIFF images"});
  ThreadPool pool(a.threads > 0 ? a.threads : processor_cores());
  const TrainingSet set = extract_all(*files, a, pool);
  if (set.images.empty())
    return report_error({a.images.front(), "", "no readable image", "PNG, JPEG, WebP, PNM, BMP or TIFF images"});
  Random random(a.seed, "vocabulary");
  ProgressBar bar(a.progress == "auto", "descriptors");
  const auto vocabulary = place::train_vocabulary(set.images, a.training, random, pool,
                                                  [&](std::size_t done, std::size_t all) { bar.show(done, all); });
  bar.finish();
  if (!vocabulary) {
    Error error = vocabulary.error();
    error.file = a.images.front();
    return report_error(error);
  }
  if (const Status s = storage::write_vocabulary(**vocabulary, a.out); !s) return report_error(s.error());
  fmt::print("{}: {} words from {} descriptors of {} images ({} skipped)\n", a.out, (*vocabulary)->size(),
             set.descriptors, set.images.size(), set.skipped);
  return kExitOk;
}

int run_info(const std::string& file) {
  const auto start = std::chrono::steady_clock::now();
  const auto read = file.empty() ? place::shipped_vocabulary() : storage::read_vocabulary(file);
  const std::chrono::duration<double, std::milli> load = std::chrono::steady_clock::now() - start;
  if (!read) return report_error(read.error());
  const place::Vocabulary& v = **read;
  const std::vector<float>& weights = v.content().weight;
  const auto [min_weight, max_weight] = std::minmax_element(weights.begin(), weights.end());
  fmt::print("vocabulary   {}\n", file.empty() ? "shipped with this program" : file);
  fmt::print("descriptors  {}\n", v.kind());
  fmt::print("branching    {}\nlevels       {}\nwords        {}\nnodes        {}\n", v.branching(), v.levels(),
             v.size(), v.num_nodes());
  fmt::print("weights      {:.4f} to {:.4f}\n", *min_weight, *max_weight);
  fmt::print("size         {} bytes\n", place::serialise(v).size());
  fmt::print("id           {:016x}\n", v.id());
  fmt::print("load time    {:.1f} ms\n", load.count());
  if (v.kind() != place::kDescriptorKind) {
    fmt::print("note         trained for other descriptors than {}: place recognition is less reliable\n",
               place::kDescriptorKind);
  }
  return kExitOk;
}

void add_train(CLI::App& vocab, int& exit_status) {
  const auto arguments = std::make_shared<VocabTrainArguments>();
  VocabTrainArguments& a = *arguments;
  CLI::App* verb = vocab.add_subcommand("train", "train a vocabulary on images");
  verb->add_option("IMAGES", a.images,
                   "PNG, JPEG, WebP, PNM, BMP or TIFF images, or folders that are searched for them recursively")
      ->required();
  verb->add_option("--out", a.out, "file to write")->required();
  verb->add_option("--branching", a.training.branching, "number of children of a tree node")
      ->check(CLI::Range(2, place::kMaxBranching))
      ->capture_default_str();
  verb->add_option("--levels", a.training.levels, "number of levels between root and words")
      ->check(CLI::Range(1, place::kMaxLevels))
      ->capture_default_str();
  verb->add_option("--seed", a.seed, "seed of the clustering")->capture_default_str();
  verb->add_option("--features", a.features.per_image, "number of keypoints extracted per image")
      ->check(CLI::Range(50, 20000))
      ->capture_default_str();
  verb->add_option("--max-side", a.max_side,
                   "maximum length of the longer side in pixels; larger images are scaled down; 0: no limit")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  verb->add_option("--threads", a.threads, "number of threads; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  verb->add_option("--progress", a.progress, "auto: show a progress bar if stderr is a terminal; never: show none")
      ->check(CLI::IsMember({"auto", "never"}))
      ->capture_default_str();
  verb->add_flag("--overwrite", a.overwrite, "replace an existing file");
  verb->callback([arguments, &exit_status] { exit_status = run_train(*arguments); });
}

}  // namespace

void add_vocab(CLI::App& app, int& exit_status) {
  CLI::App* vocab = app.add_subcommand("vocab", "train or describe a vocabulary for place recognition");
  vocab->require_subcommand(1);
  add_train(*vocab, exit_status);
  const auto file = std::make_shared<std::string>();
  CLI::App* info = vocab->add_subcommand("info", "print kind, size, id and weights of a vocabulary");
  info->add_option("FILE", *file,
                   "bslam vocabulary or DBoW2 text file (default: the vocabulary shipped with this program)");
  info->callback([file, &exit_status] { exit_status = run_info(*file); });
}

}  // namespace bslam::cli
