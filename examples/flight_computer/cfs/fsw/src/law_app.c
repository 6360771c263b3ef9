/* The rover's attitude law as an app of cFS: one attitude packet in, one command and one funnel packet out.
 *
 * The payload of a packet is the body of the message. Whoever brings attitudes onto the software bus (an estimator's app, or a
 * bridge from DDS or a serial line) fills it; the stamp in it, not the packet's time, is the time of the law. */
#include <string.h>

#include "cfe.h"
#include "firmware.h"

/* of the mission's table of message ids */
#define LAW_ATTITUDE_MID 0x0890
#define LAW_COMMAND_MID  0x0891
#define LAW_FUNNEL_MID   0x0892

#define LAW_STARTED_EID 1
#define LAW_PIPE_EID    2
#define LAW_LENGTH_EID  3
#define LAW_FAULT_EID   4

#define LAW_EPOCH_NS INT64_C(946728000000000000) /* J2000: the stamp of t = 0 */

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    uint8                     Body[FIRMWARE_ATTITUDE];
} LAW_Attitude_t;

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    uint8                     Body[FIRMWARE_COMMAND];
} LAW_Command_t;

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    uint8                     Body[FIRMWARE_FUNNEL];
} LAW_Funnel_t;

static struct {
    uint32          RunStatus;
    CFE_SB_PipeId_t Pipe;
    LAW_Command_t   Command;
    LAW_Funnel_t    Funnel;
} LAW_Data;

static CFE_Status_t LAW_Init(void) {
    CFE_Status_t status;

    LAW_Data.RunStatus = CFE_ES_RunStatus_APP_RUN;
    firmware_begin(LAW_EPOCH_NS);
    status = CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
    if (status != CFE_SUCCESS) return status;
    CFE_MSG_Init(CFE_MSG_PTR(LAW_Data.Command.TelemetryHeader), CFE_SB_ValueToMsgId(LAW_COMMAND_MID), sizeof(LAW_Data.Command));
    CFE_MSG_Init(CFE_MSG_PTR(LAW_Data.Funnel.TelemetryHeader), CFE_SB_ValueToMsgId(LAW_FUNNEL_MID), sizeof(LAW_Data.Funnel));
    status = CFE_SB_CreatePipe(&LAW_Data.Pipe, 10, "LAW_PIPE");
    if (status != CFE_SUCCESS) return status;
    status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(LAW_ATTITUDE_MID), LAW_Data.Pipe);
    if (status != CFE_SUCCESS) return status;
    CFE_EVS_SendEvent(LAW_STARTED_EID, CFE_EVS_EventType_INFORMATION, "LAW: waiting for attitudes");
    return CFE_SUCCESS;
}

static void LAW_Answer(const CFE_SB_Buffer_t *buffer) {
    const LAW_Attitude_t *attitude = (const LAW_Attitude_t *)buffer;
    CFE_MSG_Size_t        size     = 0;
    int                   fault;

    CFE_MSG_GetSize(&buffer->Msg, &size);
    if (size != sizeof(LAW_Attitude_t)) {
        CFE_EVS_SendEvent(LAW_LENGTH_EID, CFE_EVS_EventType_ERROR, "LAW: an attitude of %lu bytes, expected %lu",
                          (unsigned long)size, (unsigned long)sizeof(LAW_Attitude_t));
        return;
    }
    fault = firmware_step(attitude->Body, LAW_Data.Command.Body, LAW_Data.Funnel.Body);
    if (fault != 0) { /* nothing more is commanded: what a wheel does without commands is the drive's matter */
        CFE_EVS_SendEvent(LAW_FAULT_EID, CFE_EVS_EventType_CRITICAL, "LAW: the law has stopped: fault %d", fault);
        LAW_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
        return;
    }
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(LAW_Data.Command.TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(LAW_Data.Command.TelemetryHeader), true);
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(LAW_Data.Funnel.TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(LAW_Data.Funnel.TelemetryHeader), true);
}

void LAW_AppMain(void) {
    CFE_SB_Buffer_t *buffer;
    CFE_Status_t     status;

    if (LAW_Init() != CFE_SUCCESS) LAW_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
    while (CFE_ES_RunLoop(&LAW_Data.RunStatus)) {
        status = CFE_SB_ReceiveBuffer(&buffer, LAW_Data.Pipe, CFE_SB_PEND_FOREVER);
        if (status == CFE_SUCCESS) {
            LAW_Answer(buffer);
        } else {
            CFE_EVS_SendEvent(LAW_PIPE_EID, CFE_EVS_EventType_ERROR, "LAW: its pipe cannot be read, 0x%08lX",
                              (unsigned long)status);
            LAW_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
        }
    }
    CFE_ES_ExitApp(LAW_Data.RunStatus);
}
