#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "nido/middleware/node.h"
#include "nido/msgs/types.h"

namespace nido {

// One picture as the page shows it.
struct ShownPicture {
  std::uint64_t number = 0;  // counts up over all cameras
  double time_s = 0;         // of the picture
  std::string jpeg;          // empty: there was no newer one in time
  std::string trouble;       // why there is none
};

// Pictures of image ports, for whoever looks. A port is read only while somebody asks for its pictures, and a
// picture that nobody asks for is not compressed, so a page that is slow costs less. Thread-safe.
class Cameras {
 public:
  using Deliver = std::function<void(ShownPicture)>;

  explicit Cameras(Node& node);
  ~Cameras();

  // Delivers the first picture of the port that is newer than `after`, or what there is after wait_s; on a
  // thread of this object.
  void ask(const std::string& port, std::uint64_t after, double wait_s, Deliver deliver);

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Wish {
    std::uint64_t after = 0;
    SteadyClock::time_point until;
    Deliver deliver;
  };
  struct Camera {
    std::unique_ptr<Input<msgs::Image>> input;
    std::vector<Wish> wishes;
    SteadyClock::time_point last_asked;
    ShownPicture picture;
  };
  void work();
  void serve(const std::string& port, Camera& camera, std::vector<std::pair<Deliver, ShownPicture>>& done);

  Node& node_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Camera> cameras_;
  std::uint64_t pictures_ = 0;
  bool stops_ = false;
  std::thread thread_;
};

}  // namespace nido
