// The page of a run: started by `nido launch --dashboard` beside small nodes, looked at, driven, and gone
// with it.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "browser.h"
#include "temp_folder.h"
#include "tool.h"

namespace nido::test {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;

class Dashboard : public testing::Test {
 protected:
  // A run of a clock, a follower, and a judge that tells a story at tick 10 and an outcome at tick `at`.
  void launch(int at, const std::vector<std::string>& more = {"--dashboard=0"}) {
    const std::string node = std::string("  - {program: ") + TEST_NODE + ", ";
    const std::string file = folder_.write(
        "small.yaml",
        "name: small\nsummary: a small app\nstory: /judge/stage:o\noutcome: /judge/outcome:o\nprocesses:\n" +
            node +
            "name: robot, clock: owner, parameters: {behaviour: clock, lockstep: {nodes: "
            "'${lockstep_nodes}'}}}\n" +
            node + "name: eye, depends_on: [robot], parameters: {behaviour: follow}}\n" + node +
            "name: judge, depends_on: [eye], parameters: {behaviour: judge, at: " + std::to_string(at) +
            "}}\n");
    std::vector<std::string> words = {"launch",       file,       "--out",
                                      out().string(), "--domain", std::to_string(test_domain())};
    words.insert(words.end(), more.begin(), more.end());
    run_ = std::make_unique<Program>(NIDO, words);
  }
  // The port that the launcher told.
  int port() {
    if (!run_->wait_for("drive it at http://127.0.0.1:")) return -1;
    const std::string text = run_->out();
    return std::atoi(text.c_str() + text.find("http://127.0.0.1:") + 17);
  }
  // Until the dashboard listens.
  static bool is_up(int port) {
    return becomes_true([port] { return Browser(port).is_open(); });
  }
  static std::string token_of(int port) {
    Browser browser(port);
    browser.get("/");
    const std::string page = browser.reply();
    const std::size_t at = page.find("name=\"nido-token\" content=\"");
    return at == std::string::npos ? "" : page.substr(at + 27, 32);
  }
  bool nothing_lives() const {
    return becomes_true([this] { return processes_with(out().string()).empty(); }, seconds(5));
  }
  fs::path out() const { return folder_.path() / "out"; }

  TempFolder folder_;
  std::unique_ptr<Program> run_;
};

TEST_F(Dashboard, ShowsARunAndLetsItBeDriven) {
  launch(1'000'000);
  const int at = port();
  ASSERT_TRUE(is_up(at)) << run_->out() << run_->err();
  const std::string token = token_of(at);
  ASSERT_EQ(token.size(), 32U);
  EXPECT_EQ(token, token_of(at));

  Browser page(at);
  page.get("/");
  const std::string html = page.reply();
  EXPECT_NE(html.find("<!doctype html>"), std::string::npos);
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
  // nothing is fetched from elsewhere
  EXPECT_EQ(html.find("https://"), std::string::npos);
  EXPECT_EQ(html.find("@NONCE@"), std::string::npos);

  Browser stream(at);
  stream.get("/events");
  EXPECT_TRUE(stream.wait_for("text/event-stream")) << stream.got();
  EXPECT_TRUE(stream.wait_for("\"name\":\"eye\"")) << stream.got();
  EXPECT_TRUE(stream.wait_for("\"state\":\"ready\"")) << stream.got();
  EXPECT_TRUE(stream.wait_for("\"app\":\"small\"")) << stream.got();
  EXPECT_TRUE(stream.wait_for("the blue cube is there")) << stream.got();
  EXPECT_TRUE(stream.wait_for("event: ports")) << stream.got();
  EXPECT_TRUE(stream.wait_for("/judge/outcome:o")) << stream.got();
  EXPECT_TRUE(stream.wait_for("\"simulated_s\":")) << stream.got();
  // one that comes later is told the same
  Browser late(at);
  late.get("/events");
  EXPECT_TRUE(late.wait_for("the blue cube is there")) << late.got();

  Browser order(at);
  order.post("/ask", R"({"port":"/eye/control","text":"help"})", token);
  std::string reply = order.reply();
  EXPECT_NE(reply.find("\"answer\":"), std::string::npos) << reply;
  order.post("/ask", R"({"port":"/eye/nothing","text":"help"})", token);
  reply = order.reply();
  EXPECT_NE(reply.find("there is no service /eye/nothing"), std::string::npos) << reply;
  order.post("/say", R"({"text":"grasp red ball"})", token);
  reply = order.reply();
  EXPECT_NE(reply.find("error"), std::string::npos) << reply;

  order.post("/stop", "{}", token);
  reply = order.reply();
  EXPECT_NE(reply.find("\"answer\":\"ok\""), std::string::npos) << reply;
  const Ended ended = run_->wait();
  EXPECT_EQ(ended.code, 130) << ended.out << ended.err;
  EXPECT_NE(ended.out.find("stopped from the dashboard"), std::string::npos) << ended.out;
  // and the page is told how it ended
  EXPECT_TRUE(stream.wait_for("\"sentence\":\"stopped from the dashboard\"")) << stream.got();
  EXPECT_TRUE(stream.wait_for("event: bye")) << stream.got();
  EXPECT_TRUE(stream.wait_for_end());
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Dashboard, OrdersFromElsewhereAreRefused) {
  launch(1'000'000);
  const int at = port();
  ASSERT_TRUE(is_up(at)) << run_->out() << run_->err();
  const std::string token = token_of(at);
  const auto refused = [at](const std::string& path, const std::string& body, const std::string& its_token,
                            const std::string& more) {
    Browser browser(at);
    browser.post(path, body, its_token, more);
    return browser.reply().substr(0, 12);
  };
  EXPECT_EQ(refused("/stop", "{}", "", ""), "HTTP/1.1 403");
  EXPECT_EQ(refused("/stop", "{}", std::string(32, '0'), ""), "HTTP/1.1 403");
  EXPECT_EQ(refused("/stop", "{}", token, "Origin: http://evil.example\r\n"), "HTTP/1.1 403");
  EXPECT_EQ(refused("/stop", "{}", token, "Origin: null\r\n"), "HTTP/1.1 403");
  EXPECT_EQ(refused("/ask", "no json", token, ""), "HTTP/1.1 400");
  EXPECT_EQ(refused("/ask", "{\"port\":1,\"text\":[]}", token, ""), "HTTP/1.1 400");
  EXPECT_EQ(refused("/nothing", "{}", token, ""), "HTTP/1.1 404");
  Browser rebound(at);
  rebound.send("GET / HTTP/1.1\r\nHost: evil.example:" + std::to_string(at) + "\r\n\r\n");
  const std::string reply = rebound.reply();
  EXPECT_EQ(reply.substr(0, 12), "HTTP/1.1 421");
  EXPECT_EQ(reply.find(token), std::string::npos);
  for (const std::string& bytes : {std::string(30'000, 'a'), std::string("\0\0\0\0\r\n\r\n", 8),
                                   std::string("GET /camera?port=%00 HTTP/1.1\r\nHost: x\r\n\r\n")}) {
    Browser browser(at);
    browser.send(bytes);
    EXPECT_TRUE(browser.wait_for_end());
  }
  Browser camera(at);
  camera.get("/camera?port=/judge/stage:o");
  EXPECT_EQ(camera.reply().substr(0, 12), "HTTP/1.1 404");
  // nothing of it has stopped the run
  EXPECT_TRUE(is_up(at));
  run_->signal(SIGINT);
  EXPECT_EQ(run_->wait().code, 130);
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Dashboard, ARunGoesOnWhenItsDashboardIsKilledAndGetsAnotherOne) {
  launch(4000);
  const int at = port();
  ASSERT_TRUE(is_up(at)) << run_->out() << run_->err();
  ASSERT_TRUE(run_->wait_for("4 processes are ready")) << run_->out();
  const auto pids = processes_with((out() / "nodes" / "dashboard.yaml").string());
  ASSERT_EQ(pids.size(), 1U);
  kill(pids.front(), SIGKILL);
  EXPECT_TRUE(run_->wait_for("process 'dashboard' is ready again")) << run_->out();
  EXPECT_TRUE(is_up(at));
  const Ended ended = run_->wait();
  EXPECT_EQ(ended.code, 0) << ended.out << ended.err;
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Dashboard, AKilledLauncherLeavesNoDashboard) {
  launch(1'000'000);
  ASSERT_TRUE(is_up(port())) << run_->out() << run_->err();
  run_->signal(SIGKILL);
  run_->wait();
  EXPECT_TRUE(nothing_lives());
}

TEST_F(Dashboard, ATakenPortIsRefusedBeforeAnythingStarts) {
  launch(1'000'000);
  const int at = port();
  ASSERT_TRUE(is_up(at)) << run_->out() << run_->err();
  Program second(NIDO, {"launch", (folder_.path() / "small.yaml").string(),
                        "--dashboard=" + std::to_string(at), "--out", (folder_.path() / "second").string()});
  const Ended refused = second.wait();
  EXPECT_EQ(refused.code, 2) << refused.out;
  EXPECT_NE(refused.err.find("port " + std::to_string(at) + " of 127.0.0.1 is taken"), std::string::npos)
      << refused.err;
  EXPECT_FALSE(fs::exists(folder_.path() / "second"));
  for (const char* wrong : {"abc", "-1", "65536"}) {
    Program third(NIDO,
                  {"launch", (folder_.path() / "small.yaml").string(), std::string("--dashboard=") + wrong});
    const Ended ended = third.wait();
    EXPECT_EQ(ended.code, 2) << wrong << ended.out << ended.err;
  }
}

TEST_F(Dashboard, LooksAtWhatRunsAlready) {
  launch(1'000'000, {});
  ASSERT_TRUE(run_->wait_for("3 processes are ready")) << run_->out() << run_->err();
  Program dashboard(NIDO, {"dashboard", "--port", "0", "--domain", std::to_string(test_domain())});
  ASSERT_TRUE(dashboard.wait_for("http://127.0.0.1:")) << dashboard.out() << dashboard.err();
  const std::string text = dashboard.out();
  const int at = std::atoi(text.c_str() + text.find("http://127.0.0.1:") + 17);
  ASSERT_TRUE(is_up(at));
  Browser stream(at);
  stream.get("/events");
  EXPECT_TRUE(stream.wait_for("\"name\":\"eye\"")) << stream.got();
  // what was told before it came
  EXPECT_TRUE(stream.wait_for("the blue cube is there")) << stream.got();
  dashboard.signal(SIGINT);
  EXPECT_EQ(dashboard.wait().code, 0);
  EXPECT_TRUE(stream.wait_for_end());
  run_->signal(SIGINT);
  EXPECT_EQ(run_->wait().code, 130);
}

}  // namespace
}  // namespace nido::test
