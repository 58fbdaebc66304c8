// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>

namespace polarscan {

// Keeps recently used values under a limit of bytes. Not for several threads at once.
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
    while (!order_.empty() && used_ + bytes > limit_) DropOldest();
    order_.push_front(key);
    entries_[key] = {value, bytes, order_.begin()};
    used_ += bytes;
    return value;
  }

 private:
  struct Entry {
    std::shared_ptr<const Value> value;
    std::size_t bytes;
    std::list<int>::iterator place;
  };
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
