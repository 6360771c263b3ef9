// The rover's attitude law as an rclcpp node: bytes of the attitude in, bytes of command and funnel out.
//
// It names no message type at compile time: the firmware knows the bodies, and four bytes of encapsulation stand before each.

#include <cstring>
#include <functional>
#include <memory>

#include "firmware.h"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp/serialized_message.hpp"

namespace
{
constexpr size_t HEAD = 4;                                      // [bytes] of encapsulation
constexpr uint8_t LITTLE_ENDIAN_CDR[HEAD] = {0x00, 0x01, 0x00, 0x00};
constexpr int64_t J2000_NS = 946728000000000000;                // the stamp of t = 0 in scenarios that say no other
}  // namespace

class LawNode : public rclcpp::Node
{
public:
  LawNode()
  : rclcpp::Node("law"), command_(HEAD + FIRMWARE_COMMAND), funnel_(HEAD + FIRMWARE_FUNNEL)
  {
    firmware_begin(declare_parameter<int64_t>("epoch_ns", J2000_NS));
    prepare(command_, HEAD + FIRMWARE_COMMAND);
    prepare(funnel_, HEAD + FIRMWARE_FUNNEL);
    const auto qos = rclcpp::QoS(10).reliable();
    command_publisher_ = create_generic_publisher("cubli/wheel_command", "sensor_msgs/msg/JointState", qos);
    funnel_publisher_ = create_generic_publisher("cubli/funnel", "sensor_msgs/msg/JointState", qos);
    attitude_ = create_generic_subscription(
      "cubli/attitude", "sensor_msgs/msg/Imu", qos,
      [this](std::shared_ptr<rclcpp::SerializedMessage> message) {answer(*message);});
  }

private:
  static void prepare(rclcpp::SerializedMessage & message, size_t size)
  {
    auto & raw = message.get_rcl_serialized_message();
    std::memcpy(raw.buffer, LITTLE_ENDIAN_CDR, HEAD);
    raw.buffer_length = size;
  }

  static uint8_t * body(rclcpp::SerializedMessage & message)
  {
    return message.get_rcl_serialized_message().buffer + HEAD;
  }

  void answer(rclcpp::SerializedMessage & attitude)
  {
    const auto & raw = attitude.get_rcl_serialized_message();
    if (raw.buffer_length < HEAD + FIRMWARE_ATTITUDE || std::memcmp(raw.buffer, LITTLE_ENDIAN_CDR, 2) != 0) {
      RCLCPP_ERROR_THROTTLE(
        get_logger(), *get_clock(), 1000, "an attitude of %zu bytes, or of another byte order: its frame is not cubli_base?",
        raw.buffer_length);
      return;
    }
    const int fault = firmware_step(body(attitude), body(command_), body(funnel_));
    if (fault != 0) {
      RCLCPP_FATAL(get_logger(), "the law has stopped: fault %d", fault);
      rclcpp::shutdown();
      return;
    }
    command_publisher_->publish(command_);
    funnel_publisher_->publish(funnel_);
  }

  rclcpp::SerializedMessage command_, funnel_;
  rclcpp::GenericPublisher::SharedPtr command_publisher_, funnel_publisher_;
  rclcpp::GenericSubscription::SharedPtr attitude_;
};

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<LawNode>());
  rclcpp::shutdown();
  return 0;
}
