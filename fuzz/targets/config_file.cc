// Settings in YAML.
#include "yaml/config_file.h"

#include "system/config.h"
#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  system::Config config;
  return {yaml::config_to_yaml(OptionTable(config)), "features.per_image: 700\nmode: sequential\n",
          "features: {per_image: 700, levels: 6}\nseed: 3\n"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  system::Config config;
  OptionTable table(config);
  const Status status = yaml::apply_config_file(table, fuzz::scratch_file("config.yaml", fuzz::as_text(data, size)));
  (void)yaml::apply_setting(table, fuzz::as_text(data, size));
  if (!status) return 0;
  const std::string yaml = yaml::config_to_yaml(table);
  system::Config again;
  OptionTable again_table(again);
  fuzz::require(yaml::apply_config_file(again_table, fuzz::scratch_file("again.yaml", yaml)).ok() &&
                    yaml::config_to_yaml(again_table) == yaml,
                "written settings must be read back equal");
  return 0;
}
