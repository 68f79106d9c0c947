#include "cameras.h"

#include <algorithm>

#include "jpeg.h"
#include "nido/middleware/typed_port.h"

namespace nido {
namespace {

using std::chrono::milliseconds;
constexpr int kQuality = 80;
// nobody has asked for so long: the port is let go
constexpr auto kForget = std::chrono::seconds(3);
constexpr std::size_t kMostCameras = 16;
constexpr std::size_t kMostWishes = 32;

std::string own_port(const Node& node, std::string port) {
  std::replace(port.begin(), port.end(), ':', '_');
  return "/" + node.options().name + port + ":i";
}

}  // namespace

Cameras::Cameras(Node& node) : node_(node), thread_([this] { work(); }) {}

Cameras::~Cameras() {
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Cameras::ask(const std::string& port, std::uint64_t after, double wait_s, Deliver deliver) {
  std::string refused;
  {
    const std::lock_guard lock(mutex_);
    if (!cameras_.contains(port) && cameras_.size() >= kMostCameras) {
      refused = "too many cameras are looked at";
    } else if (cameras_[port].wishes.size() >= kMostWishes) {
      refused = "too many look at this camera";
    } else {
      Camera& camera = cameras_[port];
      const auto now = SteadyClock::now();
      camera.last_asked = now;
      camera.wishes.push_back(
          {after,
           now + std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(wait_s)),
           deliver});
    }
  }
  if (refused.empty()) {
    changed_.notify_all();
  } else {
    deliver({0, 0, "", refused});
  }
}

// Takes the newest picture of one camera if somebody waits for one.
void Cameras::serve(const std::string& port, Camera& camera,
                    std::vector<std::pair<Deliver, ShownPicture>>& done) {
  if (!camera.input && camera.picture.trouble.empty()) {
    auto input = node_.open_input<msgs::Image>(own_port(node_, port), Profile::kSensor, 1);
    Status status = input ? (*input)->connect(port) : Status(input.error());
    if (status) {
      camera.input = std::move(*input);
    } else {
      camera.picture.trouble = status.error().message;
    }
  }
  if (camera.wishes.empty()) return;
  if (camera.input) {
    if (const auto image = camera.input->take_latest()) {
      const auto& data = image->data();
      auto jpeg = jpeg_of(
          {data.data(), data.size(), image->width(), image->height(), image->step(), image->encoding()},
          kQuality);
      camera.picture.number = ++pictures_;
      camera.picture.time_s = image->header().stamp().sec() + image->header().stamp().nanosec() * 1e-9;
      camera.picture.jpeg = jpeg ? *jpeg : "";
      camera.picture.trouble = jpeg ? "" : jpeg.error().message;
    }
  }
  const auto now = SteadyClock::now();
  std::erase_if(camera.wishes, [&](const Wish& wish) {
    const bool is_newer = camera.picture.number > wish.after || !camera.picture.trouble.empty();
    if (!is_newer && now < wish.until) return false;
    done.emplace_back(wish.deliver, is_newer ? camera.picture : ShownPicture{wish.after, 0, "", ""});
    return true;
  });
}

void Cameras::work() {
  std::unique_lock lock(mutex_);
  while (!stops_) {
    std::vector<std::pair<Deliver, ShownPicture>> done;
    std::vector<Camera> forgotten;
    for (auto& [port, camera] : cameras_) serve(port, camera, done);
    const auto now = SteadyClock::now();
    for (auto camera = cameras_.begin(); camera != cameras_.end();) {
      if (camera->second.wishes.empty() && now - camera->second.last_asked > kForget) {
        forgotten.push_back(std::move(camera->second));
        camera = cameras_.erase(camera);
      } else {
        ++camera;
      }
    }
    const bool somebody_waits = std::any_of(cameras_.begin(), cameras_.end(),
                                            [](const auto& one) { return !one.second.wishes.empty(); });
    lock.unlock();
    for (const auto& [deliver, picture] : done) deliver(picture);
    forgotten.clear();
    lock.lock();
    if (stops_) break;
    // a picture is looked for often while somebody waits, at leisure to let ports go, and not at all
    // otherwise
    if (somebody_waits) {
      changed_.wait_for(lock, milliseconds(15));
    } else if (!cameras_.empty()) {
      changed_.wait_for(lock, milliseconds(500));
    } else {
      changed_.wait(lock);
    }
  }
}

}  // namespace nido
