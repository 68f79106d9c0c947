#include <utility>

#include "nido/middleware/typed_port.h"
#include "nido/wrappers/servers.h"
#include "stamps.h"

namespace nido {
namespace {

msgs::Vector3 to_message(const Eigen::Vector3d& vector) {
  msgs::Vector3 message;
  message.x(vector.x());
  message.y(vector.y());
  message.z(vector.z());
  return message;
}

class ForceTorqueServer final : public IServer {
 public:
  ForceTorqueServer(std::string stem, IForceTorque& sensor, std::int64_t period_ns, std::string frame_id)
      : stem_(std::move(stem)), sensor_(sensor), due_(period_ns), frame_id_(std::move(frame_id)) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::WrenchStamped>(stem_ + ":o", Profile::kState);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    const Result<WrenchReading> reading = sensor_.read_wrench();
    if (!reading) return Error{reading.error().code, stem_ + ": " + reading.error().message};
    msgs::WrenchStamped message;
    message.header(header(reading->stamp_ns, frame_id_));
    message.wrench().force(to_message(reading->force_N));
    message.wrench().torque(to_message(reading->torque_Nm));
    return output_->write(message);
  }

 private:
  const std::string stem_;
  IForceTorque& sensor_;
  Due due_;
  const std::string frame_id_;
  std::unique_ptr<Output<msgs::WrenchStamped>> output_;
};

class InertialServer final : public IServer {
 public:
  InertialServer(std::string stem, IInertial& sensor, std::int64_t period_ns, std::string frame_id)
      : stem_(std::move(stem)), sensor_(sensor), due_(period_ns), frame_id_(std::move(frame_id)) {}

  Status open(Node& node) {
    auto output = node.open_output<msgs::Imu>(stem_ + ":o", Profile::kState);
    if (!output) return output.error();
    output_ = std::move(*output);
    return {};
  }

  Status publish(std::int64_t now_ns) override {
    if (!due_.at(now_ns)) return {};
    const Result<InertialReading> reading = sensor_.read_inertial();
    if (!reading) return Error{reading.error().code, stem_ + ": " + reading.error().message};
    msgs::Imu message;
    message.header(header(reading->stamp_ns, frame_id_));
    message.orientation().x(reading->q_WorldSensor.x());
    message.orientation().y(reading->q_WorldSensor.y());
    message.orientation().z(reading->q_WorldSensor.z());
    message.orientation().w(reading->q_WorldSensor.w());
    message.linear_acceleration(to_message(reading->acceleration_m_s2));
    message.angular_velocity(to_message(reading->angular_velocity_rad_s));
    return output_->write(message);
  }

 private:
  const std::string stem_;
  IInertial& sensor_;
  Due due_;
  const std::string frame_id_;
  std::unique_ptr<Output<msgs::Imu>> output_;
};

}  // namespace

Result<std::unique_ptr<IServer>> serve_force_torque(Node& node, const std::string& stem, IForceTorque& sensor,
                                                    std::int64_t period_ns, const std::string& frame_id) {
  auto server = std::make_unique<ForceTorqueServer>(stem, sensor, period_ns, frame_id);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

Result<std::unique_ptr<IServer>> serve_inertial(Node& node, const std::string& stem, IInertial& sensor,
                                                std::int64_t period_ns, const std::string& frame_id) {
  auto server = std::make_unique<InertialServer>(stem, sensor, period_ns, frame_id);
  if (Status opened = server->open(node); !opened) return opened.error();
  return std::unique_ptr<IServer>(std::move(server));
}

}  // namespace nido
