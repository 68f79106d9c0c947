#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "nido/interfaces/audio.h"
#include "nido/interfaces/camera.h"
#include "nido/interfaces/control_board.h"
#include "nido/interfaces/inertial.h"
#include "nido/interfaces/touch.h"
#include "nido/interfaces/world.h"
#include "nido/yarp/bottle.h"

namespace nido::yarp {

// A YARP network that devices of a robot are reached through: a name server, and ports of our own that theirs
// are connected to. Connections that end, because a computer of the robot restarts, are made again.
// Thread-safe.
struct NetworkOptions {
  std::string names_host = "127.0.0.1";
  int names_port = 10'000;
  // Shown to the name server and by both ends of every connection (secret_handshake.h); empty: none.
  std::string secret{};
  // This computer's address, as the robot's computers see it. One that is not loopback opens our ports to the
  // robot's network; they take readings, no commands.
  std::string own_host = "127.0.0.1";
  std::string local = "/nido";  // first part of our own ports' names
  double timeout_s = 2.0;       // for each answer
  std::function<void(const std::string&)> log = [](const std::string&) {};
};

class Network {
 public:
  // Fails with kNotFound when no name server answers.
  static Result<std::shared_ptr<Network>> open(NetworkOptions options);
  virtual ~Network() = default;

  // Takes what an output of the network gives, on a thread of the network, as long as the returned object
  // lives.
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };
  using OnMessage = std::function<void(const std::string& bytes, const std::string& envelope)>;
  virtual Result<std::unique_ptr<Subscription>> subscribe(const std::string& remote, const std::string& local,
                                                          std::size_t longest_message,
                                                          OnMessage on_message) = 0;

  // Sends to an input of the network; what is sent while nobody takes it is lost.
  class Stream {
   public:
    virtual ~Stream() = default;
    virtual Status send(Bottle message) = 0;
    // Waits until what was sent has left, so that it is there before what is asked afterwards.
    virtual void flush() = 0;
  };
  virtual Result<std::unique_ptr<Stream>> stream_to(const std::string& remote, const std::string& local) = 0;

  // A time of the network's clock as one of this side's, whose clock says now_ns. What is one moment there is
  // one here, whichever device tells it. The offset is that of the message that came fastest in the last
  // seconds.
  virtual std::int64_t to_own_clock(std::int64_t remote_ns, std::int64_t now_ns) = 0;

  // From now on this side lives in the network's time: the newest stamp that has come is `now_ns`, and all
  // others are told by the same offset, exactly. A robot that starts again, and whose clock does so, is
  // noticed: time here goes on.
  virtual void follow_time(std::int64_t now_ns) = 0;
  // Waits until a reading of this time of our clock or a later one has come, at most timeout_s of wall time.
  // The newest time that has come. Only after follow_time().
  virtual std::int64_t wait_for_time(std::int64_t own_ns, double timeout_s) = 0;

  // Asks a port and waits for its answer. kNotFound: nobody has this name; kTimeout: no answer in time.
  virtual Result<Bottle> ask(const std::string& remote, const Bottle& request) = 0;
};

// Which time the readings of devices have.
enum class StampMode {
  kRemote,      // as the far side's clock says
  kCalibrated,  // moved onto this side's clock, by the smallest delay seen in the last seconds
};

struct RemoteDevice {
  std::string remote;  // stem of the far side's ports: "/icub/left_arm"
  std::string local;   // stem of ours, after the network's: "/left_arm"
  StampMode stamps = StampMode::kCalibrated;
  std::function<std::int64_t()> now_ns = [] { return std::int64_t{0}; };  // this side's clock
};

// Devices on the far side of YARP's protocol 3.x, as remote_controlboard and the others see them. They fail
// with kNotFound when the far side is not there at the start; later it may go and come.

// REMOTE/rpc:i, REMOTE/command:i, REMOTE/stateExt:o. A command switches the mode of its joints first if they
// are in another one. max_torque_Nm: of joints whose board does not tell it.
Result<std::unique_ptr<IControlBoard>> yarp_control_board(std::shared_ptr<Network> network,
                                                          const RemoteDevice& device, double max_torque_Nm);
// REMOTE (pictures) and REMOTE/rpc (the lens). `info` is what is taken when the far side does not tell of its
// lens.
Result<std::unique_ptr<ICamera>> yarp_camera(std::shared_ptr<Network> network, const RemoteDevice& device,
                                             const CameraInfo& info);
// What a taxel's number, 0..255, says.
struct TouchScale {
  double threshold = 20;    // above it the taxel is touched
  double full_scale_N = 1;  // of a taxel at 255
  int taxels = 0;           // of a patch of skin, a pad each; 0: of a hand, whose 192 are six pads
};
// REMOTE: taxels. A pad is touched when a taxel of it is.
Result<std::unique_ptr<ITouch>> yarp_touch(std::shared_ptr<Network> network, const RemoteDevice& device,
                                           const TouchScale& scale);
// REMOTE: six numbers, force and torque.
Result<std::unique_ptr<IForceTorque>> yarp_force_torque(std::shared_ptr<Network> network,
                                                        const RemoteDevice& device);
// REMOTE: twelve numbers, angles in degrees, acceleration, angular velocity in degrees/s.
Result<std::unique_ptr<IInertial>> yarp_inertial(std::shared_ptr<Network> network,
                                                 const RemoteDevice& device);
// REMOTE: sound, one or more channels at `sample_rate_hz`.
Result<std::unique_ptr<IAudioGrabberSound>> yarp_audio(std::shared_ptr<Network> network,
                                                       const RemoteDevice& device, int sample_rate_hz,
                                                       int channels);
// REMOTE: the world port of a simulator.
Result<std::unique_ptr<IWorld>> yarp_world(std::shared_ptr<Network> network, const RemoteDevice& device);

}  // namespace nido::yarp
