/* The attitude law of the rover as the firmware of a small computer: what a board, an rclcpp node, a cFS app or an F Prime
 * component calls. A message is the body of its CDR form: what a DDS sample has behind its four bytes of encapsulation. */
#ifndef FIRMWARE_H
#define FIRMWARE_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

enum { FIRMWARE_ATTITUDE = 320, FIRMWARE_COMMAND = 104, FIRMWARE_FUNNEL = 952 }; /* [bytes] */

/* epoch_ns: the stamp of t = 0 */
void firmware_begin(int64_t epoch_ns);

/* One attitude in, a command and a funnel out. Returns 0, or the code of what has stopped the law. */
int firmware_step(const uint8_t *attitude, uint8_t *command, uint8_t *funnel);

#ifdef __cplusplus
}
#endif
#endif
