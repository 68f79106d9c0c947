#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace nido {

// A queue that needs no new memory once it has been as long as it gets.
template <class T>
class Ring {
 public:
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  T& front() { return places_[first_]; }
  T& back() { return places_[(first_ + size_ - 1) % places_.size()]; }
  void push_back(T value) {
    if (size_ == places_.size()) {
      grow();
    }
    places_[(first_ + size_) % places_.size()] = std::move(value);
    ++size_;
  }
  void pop_front() {
    places_[first_] = T();
    first_ = (first_ + 1) % places_.size();
    --size_;
  }
  void clear() {
    while (!empty()) {
      pop_front();
    }
  }

 private:
  void grow() {
    std::vector<T> more(places_.empty() ? 4 : 2 * places_.size());
    for (std::size_t i = 0; i < size_; ++i) {
      more[i] = std::move(places_[(first_ + i) % places_.size()]);
    }
    places_.swap(more);
    first_ = 0;
  }

  std::vector<T> places_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace nido
