// The only way from outside to what a public class hides.
#pragma once

#include <memory>
#include <utility>

namespace bslam::api {

struct Access {
  template <class T>
  static const auto& impl(const T& object) {
    return *object.impl_;
  }

  // A Rig or MapView of these members of its Impl.
  template <class T, class... Members>
  static T make(Members&&... members) {
    using Impl = typename T::Impl;
    return T(std::make_shared<const Impl>(Impl{std::forward<Members>(members)...}));
  }
};

}  // namespace bslam::api
