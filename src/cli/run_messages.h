// What `bslam run` says on the terminal when it is done; everything is in the summary as well.
#pragma once

#include <string>

#include "report/run_record.h"

namespace bslam::cli {

// On stderr: cameras that were out, images that could not be used, frames there was no time for, extrinsics that do not fit.
void print_warnings(const report::RunRecord& record);

// On stdout: how many frames have a pose, the size of the map, where the files are.
void print_result(const report::RunRecord& record, const std::string& out);

}  // namespace bslam::cli
