// SPDX-License-Identifier: Apache-2.0
// Aravis speaks GLib: its objects, errors and texts in C++.
#pragma once
#include <arv.h>
#include <fmt/format.h>

#include <memory>
#include <string>

#include "core/error.h"

#if !ARAVIS_CHECK_VERSION(0, 8, 20)
#error "Aravis 0.8.20 or newer of the 0.8 series is needed"
#endif

namespace polarscan::aravis {

// For Object.
struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
// An object of which this is one owner.
template <class T>
using Object = std::unique_ptr<T, Unref>;

// A GError that turns into an Error.
class Failure {
 public:
  ~Failure() { g_clear_error(&error_); }
  GError** operator&() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  bool NotFound() const { return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND); }
  std::string text() const { return error_ ? error_->message : ""; }
  // Does nothing where all is well.
  void Throw(const std::string& what, const std::string& where, const std::string& advice = "") const {
    if (error_) throw Error(fmt::format("{} ({})", what, error_->message), where, advice);
  }

 private:
  GError* error_ = nullptr;
};

// Null: empty.
inline std::string Text(const char* text) { return text ? text : ""; }

}  // namespace polarscan::aravis
