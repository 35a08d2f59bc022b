// Text for the enumerators of the public headers that have none in the estimator, and the version of the library. The
// others are beside their conversions.
#include <bslam/bslam.h>

namespace bslam {

std::string_view to_string(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kNotStarted:
      return "not-started";
    case TrackingStatus::kTracking:
      return "tracking";
    case TrackingStatus::kLost:
      return "lost";
  }
  return "";
}

std::string_view to_string(LostReason reason) {
  switch (reason) {
    case LostReason::kNone:
      return "";
    case LostReason::kNotStarted:
      return "not-started";
    case LostReason::kNoImages:
      return "no-images";
    case LostReason::kFewFeatures:
      return "few-features";
    case LostReason::kFewMatches:
      return "few-matches";
    case LostReason::kFewInliers:
      return "few-inliers";
    case LostReason::kUnstablePose:
      return "unstable-pose";
    case LostReason::kNotFound:
      return "not-found";
  }
  return "";
}

std::string_view to_string(DropReason reason) {
  switch (reason) {
    case DropReason::kDuplicate:
      return "duplicate";
    case DropReason::kTooLate:
      return "too-late";
    case DropReason::kFarAhead:
      return "far-ahead";
    case DropReason::kOverflow:
      return "overflow";
  }
  return "";
}

std::string_view to_string(CalibrationVerdict verdict) {
  switch (verdict) {
    case CalibrationVerdict::kUnknown:
      return "unknown";
    case CalibrationVerdict::kConsistent:
      return "consistent";
    case CalibrationVerdict::kInconsistent:
      return "inconsistent";
  }
  return "";
}

std::string_view version() { return BSLAM_VERSION; }

}  // namespace bslam
