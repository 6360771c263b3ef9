/* Static memory, one call a message, no ROS in it.
 *
 *   flight export-c cubli_ros/appc_controller --out law
 *   cc -std=c11 -O2 -shared -fPIC -Ilaw firmware.c law/appc_controller_data.c -Llaw -lappc_controller -o firmware.so */
#include "firmware.h"
#include "appc_controller.h"

static_assert(FIRMWARE_ATTITUDE == APPC_CONTROLLER_ATTITUDE_SIZE && FIRMWARE_COMMAND == APPC_CONTROLLER_COMMAND_SIZE &&
              FIRMWARE_FUNNEL == APPC_CONTROLLER_FUNNEL_SIZE, "sizes of the messages");

static struct appc_controller_parameters parameters;
static struct appc_controller_state state;
static struct appc_controller_attitude_message attitude;
static struct appc_controller_command_message command;
static struct appc_controller_funnel_message funnel;
static int64_t epoch;

void firmware_begin(int64_t epoch_ns) {
  epoch = epoch_ns;
  appc_controller_begin(&parameters, &state);
  appc_controller_blank_attitude(&attitude);
  appc_controller_blank_command(&command);
  appc_controller_blank_funnel(&funnel);
  appc_controller_start(0, &parameters, &state, 0);
}

int firmware_step(const uint8_t *attitude_body, uint8_t *command_body, uint8_t *funnel_body) {
  memcpy(&attitude, attitude_body, FIRMWARE_ATTITUDE);
  int64_t stamp_ns = attitude.header.stamp.sec * INT64_C(1000000000) + attitude.header.stamp.nanosec;
  appc_controller_stamp(&command, APPC_CONTROLLER_COMMAND_STAMP, stamp_ns);
  appc_controller_stamp(&funnel, APPC_CONTROLLER_FUNNEL_STAMP, stamp_ns);
  appc_controller_kernel(stamp_ns - epoch, &parameters, &state, (void *[]){&attitude, &command, &funnel});
  memcpy(command_body, &command, FIRMWARE_COMMAND);
  memcpy(funnel_body, &funnel, FIRMWARE_FUNNEL);
  return (int)state.fault;
}
