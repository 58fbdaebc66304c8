// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/parallel.h"

namespace polarscan {

// Keeps recently used values under a limit of bytes. Not to be called by several threads at once.
template <class Value>
class Cache {
 public:
  Cache(std::size_t limit_bytes, std::function<Value(int)> load,
        std::function<std::size_t(const Value&)> size)
      : limit_(limit_bytes), load_(std::move(load)), size_(std::move(size)) {}

  std::shared_ptr<const Value> Get(int key) {
    if (auto found = entries_.find(key); found != entries_.end()) {
      order_.splice(order_.begin(), order_, found->second.place);
      return found->second.value;
    }
    auto value = std::make_shared<const Value>(load_(key));
    const std::size_t bytes = size_(*value);
    MakeRoomFor(bytes);
    Keep(key, value, bytes);
    return value;
  }

  // Several at once; what is not there is loaded by several threads, which `load` must allow. Room for it is
  // made first: expected(key) says how many bytes it will have. Together they may be more than the limit.
  std::vector<std::shared_ptr<const Value>> GetAll(const std::vector<int>& keys,
                                                   const std::function<std::size_t(int)>& expected) {
    std::vector<std::shared_ptr<const Value>> values(keys.size());
    std::size_t missing = 0;
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (entries_.contains(keys[i]))
        values[i] = Get(keys[i]);
      else
        missing += expected(keys[i]);
    MakeRoomFor(missing);
    ParallelFor(0, int(keys.size()), [&](int i) {
      auto& value = values[std::size_t(i)];
      if (!value) value = std::make_shared<const Value>(load_(keys[std::size_t(i)]));
    });
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (!entries_.contains(keys[i])) Keep(keys[i], values[i], size_(*values[i]));
    MakeRoomFor(0);
    return values;
  }

 private:
  struct Entry {
    std::shared_ptr<const Value> value;
    std::size_t bytes;
    std::list<int>::iterator place;
  };
  void Keep(int key, std::shared_ptr<const Value> value, std::size_t bytes) {
    order_.push_front(key);
    entries_[key] = {std::move(value), bytes, order_.begin()};
    used_ += bytes;
  }
  // So far that so many bytes more are within the limit.
  void MakeRoomFor(std::size_t more) {
    while (!order_.empty() && used_ + more > limit_) DropOldest();
  }
  void DropOldest() {
    used_ -= entries_.at(order_.back()).bytes;
    entries_.erase(order_.back());
    order_.pop_back();
  }
  std::size_t limit_, used_ = 0;
  std::function<Value(int)> load_;
  std::function<std::size_t(const Value&)> size_;
  std::map<int, Entry> entries_;
  std::list<int> order_;
};

}  // namespace polarscan
