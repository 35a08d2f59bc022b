// Gives the library access to the hidden implementations of the public classes.
#pragma once

#include <memory>
#include <utility>

namespace bslam::api {

struct Access {
  template <class T>
  static const auto& impl(const T& object) {
    return *object.impl_;
  }

  // Creates a Rig or MapView whose Impl has these members.
  template <class T, class... Members>
  static T make(Members&&... members) {
    using Impl = typename T::Impl;
    return T(std::make_shared<const Impl>(Impl{std::forward<Members>(members)...}));
  }
};

}  // namespace bslam::api
