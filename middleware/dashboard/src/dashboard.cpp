#include "nido/dashboard/dashboard.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "cameras.h"
#include "feeds.h"
#include "nido/dashboard/http_server.h"
#include "nido/textproto/text_value.h"
#include "page.h"
#include "system_view.h"
#include "worker.h"

namespace nido {
namespace {
using Json = nlohmann::json;
using SteadyClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr const char* kLauncher = "/launcher/rpc:i";
constexpr double kCall_s = 10;
constexpr double kCameraWait_s = 1.0;
constexpr double kDegree_rad = 3.14159265358979323846 / 180;

std::string text_of(const Json& value) {
  // what processes say need not be UTF-8
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// One server-sent event.
std::string event_of(const char* name, const Json& value) {
  return fmt::format("event: {}\ndata: {}\n\n", name, text_of(value));
}

HttpReply json_reply(const Json& value, int status = 200) {
  return {status, "application/json", text_of(value), {}, false};
}
HttpReply refusal(int status, const std::string& sentence) {
  return json_reply({{"error", sentence}}, status);
}

// Names and limits of a board's joints, rad, from its answer to "get info".
Json joints_from(const std::string& answer) {
  auto joints = Json::array();
  const auto values = parse_text(answer);
  if (!values) return joints;
  for (const TextValue& value : *values) {
    if (value.list() == nullptr) continue;
    for (const TextValue& joint : *value.list()) {
      const auto* fields = joint.list();
      if (fields == nullptr || fields->size() < 3) return Json::array();
      const std::string* name = (*fields)[0].text();
      if (name == nullptr || !(*fields)[1].is_number() || !(*fields)[2].is_number()) return Json::array();
      joints.push_back({{"name", *name},
                        {"min", (*fields)[1].number() * kDegree_rad},
                        {"max", (*fields)[2].number() * kDegree_rad}});
    }
  }
  return joints;
}

class DashboardImpl final : public Dashboard {
 public:
  DashboardImpl(Node& node, const DashboardOptions& options)
      : node_(node), view_(node.options().name), feeds_(node, options.story), cameras_(node) {}

  ~DashboardImpl() override {
    if (server_ && server_->streams() > 0) say_goodbye();
    if (loop_) loop_->post([this] { loop_->stop(); });
    if (loop_thread_.joinable()) loop_thread_.join();
    server_.reset();
  }

  Status open(const DashboardOptions& options) {
    auto directory = Directory::open(node_);
    if (!directory) return directory.error();
    directory_ = std::move(*directory);
    auto loop = yarp::EventLoop::create();
    if (!loop) return loop.error();
    loop_ = std::move(*loop);
    HttpServerOptions http;
    http.port = options.port;
    auto server =
        HttpServer::open(*loop_, http, [this](const HttpRequest& request, HttpServer::Respond respond) {
          handle(request, std::move(respond));
        });
    if (!server) return server.error();
    server_ = std::move(*server);
    loop_thread_ = std::thread([this] { loop_->run(); });
    return {};
  }

  [[nodiscard]] std::string address() const override {
    return fmt::format("http://127.0.0.1:{}/", server_->port());
  }

  void tick() override {
    const auto now = SteadyClock::now();
    if (now < next_tick_) return;
    next_tick_ = now + milliseconds(95);
    const bool somebody_looks = server_->streams() > 0;
    std::string events;
    if (now >= next_look_) {
      next_look_ = now + milliseconds(500);
      look(somebody_looks);
      tell(state_, state_event(), events);
      tell(ports_, event_of("ports", view_.ports()), events);
      tell(body_, body_event(), events);
    }
    tell(time_, time_event(), events);
    if (const Json log = feeds_.new_log(); !log.empty()) events += event_of("log", log);
    if (const Json story = feeds_.new_story(); !story.empty()) events += event_of("story", story);
    if (somebody_looks) {
      if (const Json joints = feeds_.joints(); !joints.empty()) {
        events += event_of("joints", joints);
        joints_.update(joints);
      }
      if (const Json touch = feeds_.touch(); !touch.empty()) {
        events += event_of("touch", touch);
        touch_.update(touch);
      }
    }
    if (!events.empty()) {
      loop_->post([this, events = std::move(events)] { server_->broadcast(events); });
    }
    greet();
  }

 private:
  // How the run ended is what people want to read on a page that is left.
  void say_goodbye() {
    if (has_launcher_) {
      constexpr double kShort_s = 0.4;
      const auto answer = node_.call(kLauncher, "status", kShort_s);
      const std::lock_guard lock(mutex_);
      if (answer) launcher_ = Json::parse(*answer, nullptr, false);
    }
    std::string events;
    tell(state_, state_event(), events);
    if (const Json story = feeds_.new_story(); !story.empty()) events += event_of("story", story);
    events += event_of("bye", Json::object());
    loop_->post([this, events = std::move(events)] { server_->broadcast(events); });
  }

  // Adds an event that is not the one told last.
  static void tell(std::string& last, std::string event, std::string& events) {
    if (event == last) return;
    last = std::move(event);
    events += last;
  }

  // Those that have just come get all there is; what comes later reaches them as it does everybody.
  void greet() {
    std::vector<HttpServer::Respond> fresh;
    {
      const std::lock_guard lock(mutex_);
      fresh.swap(greetings_);
    }
    if (fresh.empty()) return;
    HttpReply reply;
    reply.type = "text/event-stream";
    reply.is_stream = true;
    reply.body = "retry: 2000\n\n" + event_of("whole_log", feeds_.whole_log()) +
                 event_of("whole_story", feeds_.whole_story()) + state_ + ports_ + body_ + time_ +
                 event_of("joints", joints_) + event_of("touch", touch_);
    for (const auto& respond : fresh) respond(reply);
  }

  void look(bool somebody_looks) {
    const auto nodes = directory_->nodes();
    view_.look(nodes);
    feeds_.follow(nodes, somebody_looks);
    const auto services = view_.ports_of("service");
    has_launcher_ = std::find(services.begin(), services.end(), kLauncher) != services.end();
    if (has_launcher_ && !asks_launcher_.exchange(true)) {
      worker_.add([this] {
        const auto answer = node_.call(kLauncher, "status", 2.0);
        if (answer) {
          const std::lock_guard lock(mutex_);
          launcher_ = Json::parse(*answer, nullptr, false);
        }
        asks_launcher_ = false;
      });
    }
    // names and limits of joints: asked once of each part, and again when that did not answer
    for (const std::string& port : view_.ports_of("output", "sensor_msgs/msg/JointState")) {
      if (!somebody_looks || !port.ends_with("/state:o") || asked_.contains(port)) continue;
      const std::string board = port.substr(0, port.size() - 8) + "/rpc:i";
      if (std::find(services.begin(), services.end(), board) == services.end()) continue;
      asked_.insert(port);
      const bool added = worker_.add([this, port, board] {
        const auto answer = node_.call(board, "get info", 2.0);
        const Json joints = answer ? joints_from(*answer) : Json::array();
        const std::lock_guard lock(mutex_);
        if (joints.empty()) {
          unanswered_.push_back(port);
        } else {
          parts_[port] = joints;
        }
      });
      if (!added) asked_.erase(port);
    }
    {
      const std::lock_guard lock(mutex_);
      for (const auto& port : unanswered_) asked_.erase(port);
      unanswered_.clear();
    }
    measure_time();
  }

  void measure_time() {
    const auto now = SteadyClock::now();
    const auto simulated_s = feeds_.simulated_s();
    if (!simulated_s) return;
    const double passed_s = std::chrono::duration<double>(now - time_since_).count();
    if (time_known_ && passed_s < 0.9) return;
    if (time_known_) rate_ = std::max(0.0, *simulated_s - simulated_s_) / passed_s;
    time_known_ = true;
    time_since_ = now;
    simulated_s_ = *simulated_s;
  }

  std::string state_event() {
    Json run;
    {
      const std::lock_guard lock(mutex_);
      run = launcher_;
    }
    if (run.is_object()) {
      if (run.contains("story")) {
        feeds_.add_past_story(run["story"]);
        run.erase("story");
      }
      run["here"] = has_launcher_;
    }
    const auto services = view_.ports_of("service");
    return event_of("state", {{"run", run},
                              {"domain", node_.options().domain},
                              {"nodes", view_.nodes()},
                              {"cameras", view_.ports_of("output", "sensor_msgs/msg/Image")},
                              {"services", services}});
  }

  std::string time_event() {
    return event_of("time", {{"simulated_s", time_known_ ? Json(*feeds_.simulated_s()) : Json()},
                             {"rate", time_known_ ? Json(rate_) : Json()}});
  }

  std::string body_event() {
    const std::lock_guard lock(mutex_);
    return event_of("body", parts_);
  }

  // On the loop's thread.
  void handle(const HttpRequest& request, HttpServer::Respond respond) {
    if (request.method == "GET") return get(request, respond);
    if (request.method == "POST") return post(request, respond);
    respond({405, "text/plain", "GET and POST are taken\n", {{"Allow", "GET, POST"}}, false});
  }

  void get(const HttpRequest& request, const HttpServer::Respond& respond) {
    if (request.path == "/") {
      const std::string nonce = random_word();
      HttpReply reply;
      reply.type = "text/html; charset=utf-8";
      reply.body = page_with(nonce, token_);
      reply.headers = {
          {"Content-Security-Policy",
           fmt::format("default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; img-src 'self' "
                       "blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
                       "frame-ancestors 'none'",
                       nonce)}};
      return respond(reply);
    }
    if (request.path == "/events") {
      const std::lock_guard lock(mutex_);
      greetings_.push_back(respond);
      return;
    }
    if (request.path == "/camera") return camera(request, respond);
    respond({404, "text/plain", "there is no such page\n", {}, false});
  }

  void camera(const HttpRequest& request, const HttpServer::Respond& respond) {
    const auto port = request.query.find("port");
    const auto after = request.query.find("after");
    const auto owner = port == request.query.end() ? std::nullopt : directory_->owner_of(port->second);
    if (!owner || owner->port.direction != "output" || owner->port.type != "sensor_msgs/msg/Image") {
      return respond({404, "text/plain", "there is no such camera\n", {}, false});
    }
    const std::uint64_t number =
        after == request.query.end() ? 0 : std::strtoull(after->second.c_str(), nullptr, 10);
    cameras_.ask(port->second, number, kCameraWait_s, [respond](const ShownPicture& picture) {
      if (!picture.trouble.empty()) return respond({503, "text/plain", picture.trouble + "\n", {}, false});
      if (picture.jpeg.empty()) return respond({204, "", "", {}, false});
      respond(
          {200,
           "image/jpeg",
           picture.jpeg,
           {{"X-Picture", std::to_string(picture.number)}, {"X-Time", fmt::format("{:.3f}", picture.time_s)}},
           false});
    });
  }

  // Orders: only from a page that this program gave out.
  void post(const HttpRequest& request, const HttpServer::Respond& respond) {
    const auto header = [&request](const char* name) {
      const auto found = request.headers.find(name);
      return found == request.headers.end() ? std::string() : found->second;
    };
    const std::string origin = header("origin");
    const std::string own = fmt::format(":{}", server_->port());
    if (!origin.empty() && origin != "http://127.0.0.1" + own && origin != "http://localhost" + own) {
      return respond(refusal(403, "orders are taken from this program's own page only"));
    }
    if (!same_secret(token_, header("x-nido-token"))) {
      return respond(refusal(403, "the token is not that of this page: load the page again"));
    }
    if (!header("content-type").starts_with("application/json")) {
      return respond(refusal(415, "orders come as application/json"));
    }
    const Json order = Json::parse(request.body, nullptr, false);
    const auto word = [&order](const char* key) {
      return order.is_object() && order.contains(key) && order[key].is_string()
                 ? order[key].get<std::string>()
                 : "";
    };
    const std::string text = word("text");
    if (request.path == "/stop") return ask(kLauncher, "stop from the dashboard", respond);
    if (request.path == "/ask") {
      if (word("port").empty() || text.empty())
        return respond(refusal(400, "an order needs \"port\" and \"text\""));
      return ask(word("port"), text, respond);
    }
    if (request.path == "/say") {
      if (text.empty()) return respond(refusal(400, "an order needs \"text\""));
      return say(text, respond);
    }
    respond(refusal(404, "there is no such order: /stop, /ask, /say"));
  }

  void say(const std::string& text, const HttpServer::Respond& respond) {
    for (const NodeDescription& node : directory_->nodes()) {
      for (const PortDescription& port : node.ports) {
        if (port.direction == "service" && port.name.ends_with("/mic/rpc:i")) {
          return ask(port.name, "say " + text, respond);
        }
      }
    }
    respond(refusal(503, "no robot here has ears that can be spoken to (a service .../mic/rpc:i)"));
  }

  void ask(const std::string& port, const std::string& text, const HttpServer::Respond& respond) {
    const auto owner = directory_->owner_of(port);
    if (!owner || owner->port.direction != "service") {
      return respond(refusal(404, fmt::format("there is no service {}", port)));
    }
    const bool added = worker_.add([this, port, text, respond] {
      const auto answer = node_.call(port, text, kCall_s);
      respond(answer ? json_reply({{"answer", *answer}}) : refusal(503, answer.error().message));
    });
    if (!added) respond(refusal(503, "too many orders wait already"));
  }

  Node& node_;
  const std::string token_ = random_word();
  std::unique_ptr<Directory> directory_;
  std::unique_ptr<yarp::EventLoop> loop_;
  std::unique_ptr<HttpServer> server_;
  std::thread loop_thread_;

  // of tick()
  SystemView view_;
  Feeds feeds_;
  SteadyClock::time_point next_tick_;
  SteadyClock::time_point next_look_;
  SteadyClock::time_point time_since_;
  bool time_known_ = false;
  double simulated_s_ = 0;
  double rate_ = 0;
  bool has_launcher_ = false;
  std::set<std::string> asked_;
  Json joints_ = Json::object();
  Json touch_ = Json::object();
  std::string state_;  // events as they were told last
  std::string ports_;
  std::string body_;
  std::string time_;

  std::mutex mutex_;  // of what follows
  std::vector<HttpServer::Respond> greetings_;
  Json launcher_;
  Json parts_ = Json::object();
  std::vector<std::string> unanswered_;

  std::atomic<bool> asks_launcher_ = false;
  // last: their threads use what is above
  Cameras cameras_;
  Worker worker_;
};

}  // namespace

Result<std::unique_ptr<Dashboard>> Dashboard::open(Node& node, DashboardOptions options) {
  auto dashboard = std::make_unique<DashboardImpl>(node, options);
  if (Status opened = dashboard->open(options); !opened) return opened.error();
  return std::unique_ptr<Dashboard>(std::move(dashboard));
}

}  // namespace nido
