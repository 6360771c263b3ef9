#include "Law/Law.hpp"

namespace Cubli {

namespace {
constexpr I64 EPOCH_NS = 946728000000000000;  // J2000: the stamp of t = 0
}

Law::Law(const char* name) : LawComponentBase(name), m_command(), m_funnel(), m_stopped(false) {
    firmware_begin(EPOCH_NS);
}

void Law::attitude_handler(FwIndexType, Fw::Buffer& data) {
    if (this->m_stopped) {
        return;
    }
    if (data.getSize() != FIRMWARE_ATTITUDE) {
        this->log_WARNING_HI_WrongLength(data.getSize());
        return;
    }
    const int fault = firmware_step(data.getData(), this->m_command, this->m_funnel);
    if (fault != 0) {
        this->m_stopped = true;
        this->log_FATAL_Stopped(fault);
        return;
    }
    Fw::Buffer command(this->m_command, sizeof this->m_command);
    Fw::Buffer funnel(this->m_funnel, sizeof this->m_funnel);
    this->command_out(0, command);
    if (this->isConnected_funnel_OutputPort(0)) {
        this->funnel_out(0, funnel);
    }
}

}  // namespace Cubli
