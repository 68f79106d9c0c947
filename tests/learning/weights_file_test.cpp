#include "nido/learning/weights_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "nido/learning/mlp.h"
#include "nido/learning/normalisation.h"

namespace nido::learning {
namespace {

WeightsFile sample() {
  WeightsFile file;
  file.command = "nido experiment run reach-learning --seed 1";
  file.notes["made"] = "for a test";
  file.matrices["a"] = Eigen::MatrixXd(2, 3);
  file.matrices["a"] << 1.0 / 3.0, -1e-300, 5e300, 0.1, -0.0, 123456789.123456789;
  file.matrices["b"] = Eigen::MatrixXd::Random(5, 1);
  return file;
}

TEST(WeightsFile, RoundTripKeepsEveryBit) {
  WeightsFile file = sample();
  std::mt19937_64 random(1);
  file.matrices["c"] = Eigen::MatrixXd(40, 5);
  for (Eigen::Index i = 0; i < file.matrices["c"].size(); ++i) {
    file.matrices["c"](i) = std::ldexp(static_cast<double>(random()), static_cast<int>(random() % 200) - 164);
  }
  const auto copy = WeightsFile::from_text(file.to_text(), "text");
  ASSERT_TRUE(copy.ok()) << copy.error().message;
  EXPECT_EQ(copy->command, file.command);
  EXPECT_EQ(copy->notes, file.notes);
  ASSERT_EQ(copy->matrices.size(), file.matrices.size());
  for (const auto& [name, matrix] : file.matrices) EXPECT_EQ(copy->matrices.at(name), matrix) << name;
  EXPECT_TRUE(std::signbit(copy->matrices.at("a")(1, 1)));
  EXPECT_EQ(copy->to_text(), file.to_text());
}

TEST(WeightsFile, NetworkAndScaleSurviveAFileOnDisk) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("nido_weights_test_" + std::to_string(getpid())));
  const Mlp network = Mlp::random(3, {{10, Activation::kSigmoid}, {5, Activation::kLinear}}, 7);
  const MinMax scale = MinMax::from_range(Eigen::Vector3d(-1, -2, -3), Eigen::Vector3d(1, 0.1, 0.7)).value();
  WeightsFile file;
  file.command = "test";
  network.write_to(file, "net");
  scale.write_to(file, "in");
  ASSERT_TRUE(file.save(path).ok());
  const auto loaded = WeightsFile::load(path);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  const auto network2 = Mlp::read_from(*loaded, "net");
  const auto scale2 = MinMax::read_from(*loaded, "in");
  ASSERT_TRUE(network2.ok() && scale2.ok());
  const Eigen::Vector3d x(0.3, -0.4, 0.5);
  EXPECT_EQ(network2->forward(scale2->to_unit(x)), network.forward(scale.to_unit(x)));
  std::filesystem::remove(path);
}

TEST(WeightsFile, BadFilesAreRefusedWithThePlace) {
  const std::string good = sample().to_text();
  const auto replaced = [&](const std::string& what, const std::string& by) {
    std::string text = good;
    const auto at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), by);
  };
  const std::vector<std::string> bad = {
      "",
      "hello",
      replaced("nido-weights 1", "nido-weights 2"),
      replaced("command ", "comand "),
      replaced("5e+300", "nan"),
      replaced("5e+300", "inf"),
      replaced("5e+300", "5x"),
      replaced("5e+300", ""),
      replaced("5e+300", "1 2"),
      replaced("matrix a 2 3", "matrix a 3 3"),
      replaced("matrix a 2 3", "matrix a -2 3"),
      replaced("matrix a 2 3", "matrix a 99999999 99999999"),
      replaced("matrix b", "matrix a"),
      replaced("end\n", ""),
      good.substr(0, good.size() / 2),
      good + "more",
  };
  for (const std::string& text : bad) {
    const auto file = WeightsFile::from_text(text, "bad.txt");
    ASSERT_FALSE(file.ok()) << text;
    EXPECT_EQ(file.error().message.rfind("bad.txt:", 0), 0U) << file.error().message;
  }
  EXPECT_TRUE(WeightsFile::from_text(good, "good.txt").ok());
}

TEST(WeightsFile, EveryCutOffFileIsRefused) {
  const std::string good = sample().to_text();
  for (std::size_t length = 0; length + 1 < good.size();
       ++length) {  // without the last newline it is still whole
    EXPECT_FALSE(WeightsFile::from_text(good.substr(0, length), "cut").ok()) << length;
  }
}

TEST(WeightsFile, MissingPartsAreNamed) {
  EXPECT_EQ(WeightsFile::load("/nonexistent/reach.txt").error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(Mlp::read_from(sample(), "net").ok());
  WeightsFile file;
  Mlp::random(3, {{10, Activation::kSigmoid}, {5, Activation::kLinear}}, 7).write_to(file, "net");
  file.notes["net"] = "sigmoid wave";
  EXPECT_FALSE(Mlp::read_from(file, "net").ok());
  file.notes["net"] = "sigmoid linear";
  file.matrices["net.1.weights"].conservativeResize(5, 9);
  EXPECT_FALSE(Mlp::read_from(file, "net").ok());
  file.matrices.erase("net.1.bias");
  const auto missing = Mlp::read_from(file, "net");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("net.1.bias"), std::string::npos);
}

}  // namespace
}  // namespace nido::learning
