// The rover's attitude law as a component of F Prime, around the firmware.

#ifndef CUBLI_LAW_HPP
#define CUBLI_LAW_HPP

#include "Law/LawComponentAc.hpp"

extern "C" {
#include "firmware.h"
}

namespace Cubli {

class Law final : public LawComponentBase {
  public:
    explicit Law(const char* name);

  private:
    void attitude_handler(FwIndexType port, Fw::Buffer& data) override;

    U8 m_command[FIRMWARE_COMMAND];
    U8 m_funnel[FIRMWARE_FUNNEL];
    bool m_stopped;
};

}  // namespace Cubli

#endif
