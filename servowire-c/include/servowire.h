/* The C interface of servowire. Made from servowire-c/src by cbindgen; do not edit.
 *
 * Licence: MIT OR Apache-2.0.
 *
 * sw_tformat_  Tamagawa T-Format        sw_aformat_  Nikon A-format           sw_hdsl_    HIPERFACE DSL
 * sw_rtex_     Panasonic RTEX           sw_sorte_    TI SORTE                 sw_nrz_     start-stop fields of a sampled line
 * sw_motion_   steps within limits      sw_step_     the step times of TI's CNC router
 * sw_clock_    nanoseconds from a timer of 32 bits
 *
 * - Most calls return sw_result_t: 0 and above (SW_OK, SW_SEND, ...) is good, below 0 is refused; sw_text() has a text for each.
 * - A call that is refused at the interface (SW_E_NULL to SW_E_NOT_FREE) changes nothing.
 * - Times are in nanoseconds, of sw_clock_ns() or any other clock that never goes backwards, unless a name says otherwise.
 * - A state (sw_tformat_t, sw_rtex_axis_t, ...) is memory of yours: static, or zeroed before its first call, and used by one context at a
 *   time. It may be copied, but for those of sw_motion_.
 * - Fields of a message are values as received. What may be used now to move a motor comes from a call that takes the time
 *   (sw_tformat_angle() and its like).
 * - sw_version() == SERVOWIRE_VERSION if header and library belong together. */

#ifndef SERVOWIRE_H
#define SERVOWIRE_H

#include <stdint.h>
#include <stdbool.h>
#include <stddef.h>

/**
 * Maximum number of frames in a response.
 */
#define SW_AFORMAT_FRAMES 6

/**
 * No time: what `sw_clock_ns()` gives for a clock that cannot be trusted. Every function refuses it, and
 * all times from 2^63 ns onwards, with `SW_E_CLOCK`, so that a little less or more than it is refused too.
 */
#define SW_NO_TIME UINT64_MAX

/**
 * Bits of an answer.
 */
#define SW_HDSL_ANSWER_BITS 61

/**
 * H-frames of a V-frame.
 */
#define SW_HDSL_V_FRAME 8

/**
 * Bytes of the longest message.
 */
#define SW_HDSL_MESSAGE 14

/**
 * The offset of a long message that has none.
 */
#define SW_HDSL_NO_OFFSET 65535

/**
 * Samples of the window of an answer: bytes, one a bit, eight samples each.
 */
#define SW_HDSL_WINDOW 72

/**
 * What an encoder answers in START, LEARN and CHECK: 61 bits, the first of the line in bit 0.
 */
#define SW_HDSL_TEST_PATTERN 1378889697208046386

/**
 * Bit 1 of byte 9 of a profile response: inside the near window.
 */
#define SW_RTEX_NEAR (1 << 1)

/**
 * Maximum number of axes in a ring.
 */
#define SW_RTEX_AXES 32

/**
 * Where the data of a frame begin, from its first byte, the source address: the output of a master frame, the payload of a device
 * frame.
 */
#define SW_SORTE_DATA_AT 2

/**
 * Length of the output for the four devices of the published application, in bytes.
 */
#define SW_SORTE_PAYLOAD 16

/**
 * Bytes of a DISCOVERY frame, from its destination to its check sequence.
 */
#define SW_SORTE_DISCOVERY 1030

/**
 * The last step with which sw_step_steps() begins.
 */
#define SW_STEP_FIRST (1 << 20)

/**
 * Tones of the published application.
 */
#define SW_STEP_TONES 10

/**
 * The release of this header, before the first dot.
 */
#define SERVOWIRE_VERSION_MAJOR 0

/**
 * The release of this header, between the dots.
 */
#define SERVOWIRE_VERSION_MINOR 1

/**
 * The release of this header, after the second dot.
 */
#define SERVOWIRE_VERSION_PATCH 0

/**
 * The release of this header as one number, 8 bits each: a later one is greater.
 */
#define SERVOWIRE_VERSION (((SERVOWIRE_VERSION_MAJOR << 16) | (SERVOWIRE_VERSION_MINOR << 8)) | SERVOWIRE_VERSION_PATCH)

/**
 * Alarms of ALM, bit by bit as the specification names them; sw_aformat_known_alarms() says which of them
 * a version has.
 */
enum sw_aformat_alm_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * BATT.
     */
    SW_AFORMAT_ALM_BATT = (1 << 0),
    /**
     * MTERR.
     */
    SW_AFORMAT_ALM_MT_ERR = (1 << 1),
    /**
     * OVFLOW.
     */
    SW_AFORMAT_ALM_OV_FLOW = (1 << 2),
    /**
     * OVSPD.
     */
    SW_AFORMAT_ALM_OV_SPD = (1 << 3),
    /**
     * MEMERR.
     */
    SW_AFORMAT_ALM_MEM_ERR = (1 << 4),
    /**
     * STERR.
     */
    SW_AFORMAT_ALM_ST_ERR = (1 << 5),
    /**
     * PSERR.
     */
    SW_AFORMAT_ALM_PS_ERR = (1 << 6),
    /**
     * BUSY.
     */
    SW_AFORMAT_ALM_BUSY_ALARM = (1 << 7),
    /**
     * MEMBUSY.
     */
    SW_AFORMAT_ALM_MEM_BUSY = (1 << 8),
    /**
     * OVTEMP.
     */
    SW_AFORMAT_ALM_OV_TEMP = (1 << 9),
    /**
     * INCERR.
     */
    SW_AFORMAT_ALM_INC_ERR = (1 << 10),
    /**
     * OVSPD_S.
     */
    SW_AFORMAT_ALM_OV_SPD_S = (1 << 11),
    /**
     * STERR_S.
     */
    SW_AFORMAT_ALM_ST_ERR_S = (1 << 12),
    /**
     * PSERR_S.
     */
    SW_AFORMAT_ALM_PS_ERR_S = (1 << 13),
    /**
     * BUSY_S.
     */
    SW_AFORMAT_ALM_BUSY_S = (1 << 14),
    /**
     * INCERR_S.
     */
    SW_AFORMAT_ALM_INC_ERR_S = (1 << 15),
};
#ifndef __cplusplus
typedef uint16_t sw_aformat_alm_t;
#endif // __cplusplus

/**
 * Refusals of A-format, in the order of their numbers.
 */
enum sw_aformat_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * The response is too short.
     */
    SW_E_AFORMAT_TRUNCATED = -513,
    /**
     * A start bit reads 1.
     */
    SW_E_AFORMAT_START_BIT = -514,
    /**
     * A delimiter reads 0.
     */
    SW_E_AFORMAT_DELIMITER = -515,
    /**
     * The CRC-8 of a response is wrong.
     */
    SW_E_AFORMAT_CRC = -516,
    /**
     * The CRC-3 of a request is wrong.
     */
    SW_E_AFORMAT_CRC3 = -517,
    /**
     * The sync code is wrong.
     */
    SW_E_AFORMAT_SYNC_CODE = -518,
    /**
     * The fixed bit reads 1.
     */
    SW_E_AFORMAT_FIXED_BIT = -519,
    /**
     * Another address answers.
     */
    SW_E_AFORMAT_ADDRESS_MISMATCH = -520,
    /**
     * Another command is answered.
     */
    SW_E_AFORMAT_COMMAND_MISMATCH = -521,
    /**
     * The bank does not exist.
     */
    SW_E_AFORMAT_BANK_ERROR = -522,
    /**
     * An argument was returned with a different value.
     */
    SW_E_AFORMAT_ECHO_MISMATCH = -523,
    /**
     * The frame code is wrong.
     */
    SW_E_AFORMAT_FRAME_CODE = -524,
    /**
     * The command does not exist.
     */
    SW_E_AFORMAT_UNKNOWN_COMMAND = -525,
    /**
     * The encoder's version does not have this.
     */
    SW_E_AFORMAT_UNSUPPORTED_IN_VERSION = -526,
    /**
     * An address is out of its range.
     */
    SW_E_AFORMAT_ADDRESS_RANGE = -527,
    /**
     * Data is out of its range.
     */
    SW_E_AFORMAT_DATA_RANGE = -528,
    /**
     * No response came in time.
     */
    SW_E_AFORMAT_NO_RESPONSE = -529,
    /**
     * The encoder stayed busy.
     */
    SW_E_AFORMAT_BUSY = -530,
    /**
     * Another request came in between.
     */
    SW_E_AFORMAT_INTERRUPTED = -531,
    /**
     * It is not known whether the act was done.
     */
    SW_E_AFORMAT_EFFECT_UNKNOWN = -532,
    /**
     * The act was not done.
     */
    SW_E_AFORMAT_NOT_DONE = -533,
    /**
     * The encoder reports a fault of its memory.
     */
    SW_E_AFORMAT_MEMORY_FAULT = -534,
    /**
     * A request does not carry this.
     */
    SW_E_AFORMAT_NOT_CARRIED = -536,
    /**
     * Two sound responses in one block.
     */
    SW_E_AFORMAT_TWO_RESPONSES = -538,
    /**
     * The settings of the line leave no time for a response.
     */
    SW_E_AFORMAT_LINE = -539,
};
#ifndef __cplusplus
typedef int32_t sw_aformat_error_t;
#endif // __cplusplus

/**
 * Bits of the encoder status ES.
 */
enum sw_aformat_es_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * The encoder is busy.
     */
    SW_AFORMAT_ES_BUSY = 1,
    /**
     * Battery.
     */
    SW_AFORMAT_ES_BATT = 2,
    /**
     * Warning.
     */
    SW_AFORMAT_ES_WARNING = 4,
    /**
     * Error.
     */
    SW_AFORMAT_ES_ERROR = 8,
};
#ifndef __cplusplus
typedef uint8_t sw_aformat_es_t;
#endif // __cplusplus

/**
 * What a response carries.
 */
enum sw_aformat_layout_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * 40 position bits.
     */
    SW_AFORMAT_ABS40 = 0,
    /**
     * Position bits 0 to 23.
     */
    SW_AFORMAT_ABS24 = 1,
    /**
     * Position bits 16 to 39.
     */
    SW_AFORMAT_ABS24H = 2,
    /**
     * Position bits 0 to 16.
     */
    SW_AFORMAT_ABS17 = 3,
    /**
     * ALM and PM-ALM.
     */
    SW_AFORMAT_STATUS = 4,
    /**
     * A word of the EEPROM.
     */
    SW_AFORMAT_EEPROM = 5,
    /**
     * A word of a bank of the EEPROM. Version 3.0.
     */
    SW_AFORMAT_EEPROM_BANK = 6,
    /**
     * Temperature.
     */
    SW_AFORMAT_TEMP = 7,
    /**
     * Identification code.
     */
    SW_AFORMAT_ID = 8,
    /**
     * Velocity coefficient. Version 3.0.
     */
    SW_AFORMAT_VELCOEF = 9,
    /**
     * ABS24 and ALM.
     */
    SW_AFORMAT_ABS24_ALM = 10,
    /**
     * ABS24 and temperature.
     */
    SW_AFORMAT_ABS24_TEMP = 11,
    /**
     * ABS24 and velocity. Version 3.0.
     */
    SW_AFORMAT_ABS24_VEL = 12,
    /**
     * ABS24, velocity and acceleration. Version 3.0.
     */
    SW_AFORMAT_ABS24_VEL_ACC = 13,
    /**
     * ABS40 and velocity. Version 3.0.
     */
    SW_AFORMAT_ABS40_VEL = 14,
};
#ifndef __cplusplus
typedef uint8_t sw_aformat_layout_t;
#endif // __cplusplus

/**
 * Factory settings of an encoder that version 3.0 leaves open; may be added.
 */
enum sw_aformat_option_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * The encoder speaks version 3.0, not 2.1.
     */
    SW_AFORMAT_VERSION_3_0 = 1,
    /**
     * Commands for the lower 24 bits are answered with velocity.
     */
    SW_AFORMAT_VELOCITY_IN_LOW = 2,
    /**
     * Resets are answered with the position.
     */
    SW_AFORMAT_POSITION_IN_RESETS = 4,
};
#ifndef __cplusplus
typedef uint8_t sw_aformat_option_t;
#endif // __cplusplus

/**
 * The bit of a byte that holds the first bit of the line.
 */
enum sw_bit_order_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * In bit 0.
     */
    SW_LSB_FIRST = 0,
    /**
     * In bit 7.
     */
    SW_MSB_FIRST = 1,
};
#ifndef __cplusplus
typedef uint8_t sw_bit_order_t;
#endif // __cplusplus

/**
 * Results that all protocols share.
 */
enum sw_code_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * Done.
     */
    SW_OK = 0,
    /**
     * Not finished: wait, hear, poll.
     */
    SW_PENDING = 1,
    /**
     * Something has to be sent: see the transmission.
     */
    SW_SEND = 2,
    /**
     * A pointer is NULL.
     */
    SW_E_NULL = -1,
    /**
     * An argument is out of its range.
     */
    SW_E_ARGUMENT = -2,
    /**
     * The state was not started, or it is of another kind.
     */
    SW_E_STATE = -3,
    /**
     * The buffer of the caller is too short; nothing was written.
     */
    SW_E_SHORT_BUFFER = -4,
    /**
     * The clock went back or was not read in time, or `SW_NO_TIME` was passed on.
     */
    SW_E_CLOCK = -5,
    /**
     * There is no such value now: nothing was exchanged yet, or the exchange was of another kind.
     */
    SW_E_NO_VALUE = -6,
    /**
     * An exchange is pending, or the line is not free yet at this time: nothing was begun.
     */
    SW_E_NOT_FREE = -7,
};
#ifndef __cplusplus
typedef int32_t sw_code_t;
#endif // __cplusplus

/**
 * Whose rules are followed if sources differ.
 */
enum sw_hdsl_dialect_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * The manual of the link: every word of an answer has to stand in the 8b/10b tables.
     */
    SW_HDSL_SICK = 0,
    /**
     * The receiver of TI's Motor Control SDK: its reduced tables, its marks, its arithmetic.
     */
    SW_HDSL_TI = 1,
};
#ifndef __cplusplus
typedef uint8_t sw_hdsl_dialect_t;
#endif // __cplusplus

/**
 * How well a 10-bit word fits the running disparity.
 */
enum sw_hdsl_disparity_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * It is in the expected column.
     */
    SW_HDSL_DISPARITY_OK = 0,
    /**
     * It is in the other column.
     */
    SW_HDSL_DISPARITY_WRONG = 1,
    /**
     * It is in neither.
     */
    SW_HDSL_DISPARITY_INVALID = 2,
};
#ifndef __cplusplus
typedef int32_t sw_hdsl_disparity_t;
#endif // __cplusplus

/**
 * Refusals of HIPERFACE DSL.
 */
enum sw_hdsl_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * Fewer bits, samples or bytes than the unit has.
     */
    SW_E_HDSL_TRUNCATED = -769,
    /**
     * A 10-bit word is in neither column of the 8b/10b tables.
     */
    SW_E_HDSL_INVALID_WORD = -770,
    /**
     * A special character where only data may be, or data where a special character must be.
     */
    SW_E_HDSL_WRONG_KIND = -771,
    /**
     * The encoder has no value for this frame.
     */
    SW_E_HDSL_ENCODER_ERROR = -772,
    /**
     * The CRC-5 of the acceleration word is wrong.
     */
    SW_E_HDSL_ACCELERATION_CRC = -773,
    /**
     * The CRC-16 of a safe position or of a message is wrong.
     */
    SW_E_HDSL_CRC = -774,
    /**
     * The block is sound, but the encoder cannot deliver a position.
     */
    SW_E_HDSL_POSITION_INVALID = -775,
    /**
     * The symbol of a parameter byte has no meaning in this direction.
     */
    SW_E_HDSL_UNDEFINED_SYMBOL = -776,
    /**
     * The line stayed high: nobody answered.
     */
    SW_E_HDSL_NO_EDGE = -777,
    /**
     * The test pattern of the start-up is at none of the delays.
     */
    SW_E_HDSL_PATTERN_NOT_FOUND = -778,
    /**
     * The answer is not the test pattern.
     */
    SW_E_HDSL_PATTERN = -779,
    /**
     * The bits are not the beginning of an H-frame.
     */
    SW_E_HDSL_FRAMING = -780,
    /**
     * The two copies of the encoder identifier differ.
     */
    SW_E_HDSL_ENCODER_ID_MISMATCH = -781,
    /**
     * The identifier asks for something that this receiver does not do.
     */
    SW_E_HDSL_UNSUPPORTED_ENCODER = -782,
    /**
     * The answer to a short message begins like a long one.
     */
    SW_E_HDSL_LONG_MESSAGE_START = -783,
    /**
     * The answer to a long message begins like a short one.
     */
    SW_E_HDSL_SHORT_MESSAGE_START = -784,
    /**
     * A sound message concerns something else.
     */
    SW_E_HDSL_HEADER = -785,
    /**
     * The encoder answered a long message with an error: its code is in the data.
     */
    SW_E_HDSL_RESOURCE = -786,
    /**
     * The encoder did not accept the message in any of the tries.
     */
    SW_E_HDSL_NOT_ACCEPTED = -787,
    /**
     * No sound answer in time in any of the tries.
     */
    SW_E_HDSL_NO_ANSWER = -788,
    /**
     * The message was dropped by a reset or a restart of the link.
     */
    SW_E_HDSL_DROPPED = -789,
    /**
     * A message of this kind is in progress.
     */
    SW_E_HDSL_BUSY = -790,
    /**
     * The link is not up.
     */
    SW_E_HDSL_NOT_LOCKED = -791,
    /**
     * A long message carries 0, 2, 4 or 8 bytes.
     */
    SW_E_HDSL_DATA_LENGTH = -792,
    /**
     * The period is shorter than the frames that have to fit into it.
     */
    SW_E_HDSL_PERIOD_TOO_SHORT = -793,
    /**
     * No pulse period is known.
     */
    SW_E_HDSL_NO_PULSE = -795,
    /**
     * No register has this address.
     */
    SW_E_HDSL_NO_REGISTER = -796,
    /**
     * The EXTRA window is outside its range.
     */
    SW_E_HDSL_EXTRA_OUT_OF_RANGE = -797,
};
#ifndef __cplusplus
typedef int32_t sw_hdsl_error_t;
#endif // __cplusplus

/**
 * What the quality monitor counts.
 */
enum sw_hdsl_quality_event_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * VSYNC in the last frame of a V-frame.
     */
    SW_HDSL_VSYNC_OK = 0,
    /**
     * No VSYNC there.
     */
    SW_HDSL_VSYNC_MISSING = 1,
    /**
     * VSYNC in one of the first seven.
     */
    SW_HDSL_VSYNC_EARLY = 2,
    /**
     * A sound safe channel 1.
     */
    SW_HDSL_SAFE1_OK = 3,
    /**
     * A damaged safe channel 1.
     */
    SW_HDSL_SAFE1_ERROR = 4,
    /**
     * A damaged safe channel 2.
     */
    SW_HDSL_SAFE2_ERROR = 5,
    /**
     * A bad word in the parameters or the pipe channel.
     */
    SW_HDSL_PARAMETER_OR_PIPE_WORD = 6,
    /**
     * A bad word in the process data channel.
     */
    SW_HDSL_ACCELERATION_WORD = 7,
    /**
     * A special character that is not known.
     */
    SW_HDSL_UNKNOWN_SPECIAL = 8,
    /**
     * RSSI below 2.
     */
    SW_HDSL_LOW_RSSI = 9,
    /**
     * STATUS2 has TEST2 set, which only SW_HDSL_TI counts.
     */
    SW_HDSL_TEST2 = 10,
};
#ifndef __cplusplus
typedef uint8_t sw_hdsl_quality_event_t;
#endif // __cplusplus

/**
 * Why the link was restarted.
 */
enum sw_hdsl_restart_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * It was not.
     */
    SW_HDSL_NO_RESTART = 0,
    /**
     * A restart was requested.
     */
    SW_HDSL_RESTART_REQUESTED = 1,
    /**
     * A START frame: no encoder, or the test pattern is not there.
     */
    SW_HDSL_RESTART_LEARN = 2,
    /**
     * The test pattern came with a wrong bit.
     */
    SW_HDSL_RESTART_PATTERN = 3,
    /**
     * The identifier was damaged, or is of an encoder that is not supported.
     */
    SW_HDSL_RESTART_IDENTIFIER = 4,
    /**
     * No VSYNC in time.
     */
    SW_HDSL_RESTART_NO_VSYNC = 5,
    /**
     * The quality monitor has run out.
     */
    SW_HDSL_RESTART_QUALITY = 6,
    /**
     * Too many consecutive acceleration words could not be used.
     */
    SW_HDSL_RESTART_ACCELERATION = 7,
    /**
     * A reason that has no name here.
     */
    SW_HDSL_RESTART_OTHER = 255,
};
#ifndef __cplusplus
typedef uint8_t sw_hdsl_restart_t;
#endif // __cplusplus

/**
 * How far a fast position is aligned with the safe one; it advances once a V-frame.
 */
enum sw_hdsl_stage_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * The position is not known; the next safe position is taken over.
     */
    SW_HDSL_STAGE_POSITION = 0,
    /**
     * The next safe position gives the error of the velocity.
     */
    SW_HDSL_STAGE_VELOCITY = 1,
    /**
     * One V-frame with correct values has to pass.
     */
    SW_HDSL_STAGE_SETTLE = 2,
    /**
     * Aligned; every safe position is compared.
     */
    SW_HDSL_STAGE_CHECK = 3,
};
#ifndef __cplusplus
typedef uint8_t sw_hdsl_stage_t;
#endif // __cplusplus

/**
 * Where the receiver is in its start-up.
 */
enum sw_hdsl_state_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * RESET.
     */
    SW_HDSL_RESET = 0,
    /**
     * SYNC.
     */
    SW_HDSL_SYNC = 1,
    /**
     * START.
     */
    SW_HDSL_START = 2,
    /**
     * LEARN.
     */
    SW_HDSL_LEARN = 3,
    /**
     * CHECK.
     */
    SW_HDSL_CHECK = 4,
    /**
     * IDREQ.
     */
    SW_HDSL_IDREQ = 5,
    /**
     * WAIT VSYNC.
     */
    SW_HDSL_WAIT_VSYNC = 6,
    /**
     * RUNNING.
     */
    SW_HDSL_RUNNING = 7,
};
#ifndef __cplusplus
typedef int32_t sw_hdsl_state_t;
#endif // __cplusplus

/**
 * Refusals of motion, in the order of their numbers.
 */
enum sw_motion_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * The axis is still moving.
     */
    SW_E_MOTION_MOVING = -1537,
    /**
     * Two steps could fall into one tick of the clock.
     */
    SW_E_MOTION_SPEED_ABOVE_CLOCK = -1538,
    /**
     * More steps than 31 bits can count.
     */
    SW_E_MOTION_TOO_MANY_STEPS = -1539,
    /**
     * No room.
     */
    SW_E_MOTION_QUEUE_FULL = -1540,
    /**
     * A target outside the soft limits.
     */
    SW_E_MOTION_SOFT_LIMIT = -1543,
    /**
     * Too few steps for the change of speed.
     */
    SW_E_MOTION_TOO_SHORT = -1544,
};
#ifndef __cplusplus
typedef int32_t sw_motion_error_t;
#endif // __cplusplus

/**
 * The progress of a homing.
 */
enum sw_motion_homing_state_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * At rest; position 0 is the place where the switch closed.
     */
    SW_MOTION_HOMING_DONE = 0,
    /**
     * Looking for the switch.
     */
    SW_MOTION_HOMING_SEEKING = 1,
    /**
     * On the switch, slowing down.
     */
    SW_MOTION_HOMING_STOPPING = 2,
    /**
     * Backing off from the switch.
     */
    SW_MOTION_HOMING_BACKING_OFF = 3,
    /**
     * Approaching the switch slowly.
     */
    SW_MOTION_HOMING_APPROACHING = 4,
    /**
     * On the switch again, slowing down.
     */
    SW_MOTION_HOMING_SETTLING = 5,
    /**
     * No switch was found within the range, or it stays closed, and the axis is stopped; or somebody else has
     * asked it for something, and it does that. Its position is not a reference.
     */
    SW_MOTION_HOMING_FAILED = 6,
};
#ifndef __cplusplus
typedef int32_t sw_motion_homing_state_t;
#endif // __cplusplus

/**
 * What the background has left to do.
 */
enum sw_motion_work_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * At rest at its target.
     */
    SW_MOTION_REST = 0,
    /**
     * Poll again.
     */
    SW_MOTION_MORE = 1,
    /**
     * Fire the interrupt now: it is stopped, and there is motion for it.
     */
    SW_MOTION_START = 2,
    /**
     * Nothing until the interrupt has progressed.
     */
    SW_MOTION_LATER = 3,
    /**
     * The stop needs more slots than the queue has: the axis comes to rest, and goes on at half of its greatest speed until
     * sw_motion_set_limits().
     */
    SW_MOTION_TOO_FEW_SLOTS = 4,
};
#ifndef __cplusplus
typedef int32_t sw_motion_work_t;
#endif // __cplusplus

/**
 * How a response answers the previous command.
 */
enum sw_rtex_acknowledgement_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * The drive has taken the command.
     */
    SW_RTEX_ACCEPTED = 0,
    /**
     * The Update_Counter is not echoed.
     */
    SW_RTEX_COUNTER_NOT_ECHOED = 1,
    /**
     * The code is not echoed yet.
     */
    SW_RTEX_CODE_NOT_YET_ECHOED = 2,
    /**
     * CMD_Error.
     */
    SW_RTEX_NOT_ACCEPTED = 3,
};
#ifndef __cplusplus
typedef int32_t sw_rtex_acknowledgement_t;
#endif // __cplusplus

/**
 * Alarms of a drive that concern the communication: main number * 256 + sub number.
 */
enum sw_rtex_alarm_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * Err27.4: the step of the command position is too large.
     */
    SW_RTEX_ALARM_COMMAND_STEP = ((27 << 8) | 4),
    /**
     * Err86.0: the cyclic data are wrong.
     */
    SW_RTEX_ALARM_CYCLIC_DATA = (86 << 8),
    /**
     * Err86.1: the cyclic code is wrong.
     */
    SW_RTEX_ALARM_CYCLIC_CODE = ((86 << 8) | 1),
    /**
     * Err86.2: the Update_Counter is wrong.
     */
    SW_RTEX_ALARM_UPDATE_COUNTER = ((86 << 8) | 2),
    /**
     * Err91.1: the command is wrong.
     */
    SW_RTEX_ALARM_COMMAND_WRONG = ((91 << 8) | 1),
};
#ifndef __cplusplus
typedef uint16_t sw_rtex_alarm_t;
#endif // __cplusplus

/**
 * The state of the communication ASIC.
 */
enum sw_rtex_asic_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * INITIAL.
     */
    SW_RTEX_ASIC_INITIAL = 0,
    /**
     * RING_CONFIG.
     */
    SW_RTEX_ASIC_RING_CONFIG = 1,
    /**
     * READY.
     */
    SW_RTEX_ASIC_READY = 2,
    /**
     * RUNNING.
     */
    SW_RTEX_ASIC_RUNNING = 3,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_asic_t;
#endif // __cplusplus

/**
 * The states of an axis.
 */
enum sw_rtex_axis_code_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Its drive has not answered yet.
     */
    SW_RTEX_STARTING = 0,
    /**
     * Servo off.
     */
    SW_RTEX_OFF = 1,
    /**
     * Servo_On is 1, and Servo_Active is not 1 yet.
     */
    SW_RTEX_SWITCHING_ON = 2,
    /**
     * Servo on.
     */
    SW_RTEX_ON = 3,
    /**
     * Slows down, for a reason.
     */
    SW_RTEX_STOPPING = 4,
    /**
     * At rest with the servo on, for a reason.
     */
    SW_RTEX_HELD = 5,
    /**
     * Servo_On is 0, and Servo_Active is not 0 yet.
     */
    SW_RTEX_SWITCHING_OFF = 6,
    /**
     * Servo off for a reason.
     */
    SW_RTEX_STOPPED = 7,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_axis_code_t;
#endif // __cplusplus

/**
 * Control bits of a command, bytes 2 and 3.
 */
enum sw_rtex_control_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * Homing_Ctrl.
     */
    SW_RTEX_HOMING_CTRL = (1 << 2),
    /**
     * TL_SW: first or second torque limit.
     */
    SW_RTEX_TL_SW = (1 << 3),
    /**
     * Gain_SW: first or second gain.
     */
    SW_RTEX_GAIN_SW = (1 << 4),
    /**
     * Servo_On. An axis sets it by itself.
     */
    SW_RTEX_SERVO_ON = (1 << 7),
    /**
     * EX-OUT1.
     */
    SW_RTEX_EX_OUT1 = (1 << 8),
    /**
     * EX-OUT2.
     */
    SW_RTEX_EX_OUT2 = (1 << 9),
    /**
     * SL_SW.
     */
    SW_RTEX_SL_SW = (1 << 11),
    /**
     * Pause.
     */
    SW_RTEX_PAUSE = (1 << 13),
    /**
     * Smooth_Stop.
     */
    SW_RTEX_SMOOTH_STOP = (1 << 14),
    /**
     * Hard_Stop.
     */
    SW_RTEX_HARD_STOP = (1 << 15),
};
#ifndef __cplusplus
typedef uint16_t sw_rtex_control_t;
#endif // __cplusplus

/**
 * Error codes of a drive, with CMD_Error.
 */
enum sw_rtex_drive_error_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * Another MAC-ID.
     */
    SW_RTEX_ERROR_MAC_ID = 17,
    /**
     * C/R is that of a response.
     */
    SW_RTEX_ERROR_DIRECTION = 18,
    /**
     * The cyclic code is not defined.
     */
    SW_RTEX_ERROR_CYCLIC_CODE = 33,
    /**
     * The non-cyclic code is not defined.
     */
    SW_RTEX_ERROR_NON_CYCLIC_CODE = 34,
    /**
     * The cyclic mode is not allowed now.
     */
    SW_RTEX_ERROR_CYCLIC_MODE = 46,
    /**
     * The Type_Code is not defined.
     */
    SW_RTEX_ERROR_TYPE_CODE = 49,
    /**
     * An argument is out of range.
     */
    SW_RTEX_ERROR_ARGUMENT = 50,
    /**
     * The feed-forward data are out of range.
     */
    SW_RTEX_ERROR_FEED_FORWARD = 52,
};
#ifndef __cplusplus
typedef uint16_t sw_rtex_drive_error_t;
#endif // __cplusplus

/**
 * Refusals of RTEX, in the order of their numbers; from -0x4f0 onwards, those of axes and procedures.
 */
enum sw_rtex_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * The block is too short.
     */
    SW_E_RTEX_TRUNCATED = -1025,
    /**
     * The block is too long.
     */
    SW_E_RTEX_TOO_LONG = -1026,
    /**
     * A command in place of a response, or the other way round.
     */
    SW_E_RTEX_DIRECTION = -1027,
    /**
     * Another MAC-ID.
     */
    SW_E_RTEX_MAC_ID = -1028,
    /**
     * The cyclic code is not defined.
     */
    SW_E_RTEX_CYCLIC_CODE = -1029,
    /**
     * The non-cyclic code is not defined.
     */
    SW_E_RTEX_NON_CYCLIC_CODE = -1030,
    /**
     * Sub_Chk is wrong.
     */
    SW_E_RTEX_SUB_CHK = -1031,
    /**
     * The sub-command is not defined.
     */
    SW_E_RTEX_SUB_COMMAND_CODE = -1032,
    /**
     * The two codes must not be used together.
     */
    SW_E_RTEX_CODE_PAIR = -1033,
    /**
     * A reserved bit is set.
     */
    SW_E_RTEX_RESERVED = -1034,
    /**
     * The axis is in another state or mode, or its drive is not ready.
     */
    SW_E_RTEX_NOT_NOW = -1264,
    /**
     * The step or the rate is beyond the limits of the axis; nothing has changed.
     */
    SW_E_RTEX_TOO_FAR = -1265,
    /**
     * ERR: the command was accepted but failed during execution.
     */
    SW_E_RTEX_EXECUTION = -1266,
    /**
     * CMD_Error: the drive did not accept the command; its code is passed along.
     */
    SW_E_RTEX_COMMAND_ERROR = -1267,
    /**
     * No answer within the limit. It is not known whether the drive has executed the command.
     */
    SW_E_RTEX_TIMED_OUT = -1268,
    /**
     * The motion did not start within the limit. It may still start.
     */
    SW_E_RTEX_NOT_STARTED = -1269,
    /**
     * The procedure was aborted by a stop, by servo off, or by another mode.
     */
    SW_E_RTEX_BROKEN_OFF = -1270,
};
#ifndef __cplusplus
typedef int32_t sw_rtex_error_t;
#endif // __cplusplus

/**
 * Execution flags of a response.
 */
enum sw_rtex_execution_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Still executing.
     */
    SW_RTEX_BUSY = (1 << 4),
    /**
     * Executed with a restriction.
     */
    SW_RTEX_WNG = (1 << 6),
    /**
     * Accepted, but failed during execution.
     */
    SW_RTEX_ERR = (1 << 7),
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_execution_t;
#endif // __cplusplus

/**
 * Why the control of a ring has stopped.
 */
enum sw_rtex_fault_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * It has not.
     */
    SW_RTEX_NO_FAULT = 0,
    /**
     * The slaves differ from the table; this stays until the system is reset.
     */
    SW_RTEX_SLAVE_INFO_MISMATCH = 1,
    /**
     * The communication has timed out.
     */
    SW_RTEX_TIMEOUT = 2,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_fault_t;
#endif // __cplusplus

/**
 * Bits 3 to 0 of byte 9 of a homing or profile response.
 */
enum sw_rtex_latch_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Latch_Comp1.
     */
    SW_RTEX_LATCH_COMP1 = (1 << 0),
    /**
     * Homing: Latch_Comp2.
     */
    SW_RTEX_LATCH_COMP2 = (1 << 1),
    /**
     * Profile: PSL.
     */
    SW_RTEX_PSL = (1 << 3),
    /**
     * Profile: NSL.
     */
    SW_RTEX_NSL = (1 << 2),
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_latch_t;
#endif // __cplusplus

/**
 * What the LED of a controller shows.
 */
enum sw_rtex_led_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * Dark.
     */
    SW_RTEX_LED_OFF = 0,
    /**
     * Green.
     */
    SW_RTEX_LED_GREEN = 1,
    /**
     * Red.
     */
    SW_RTEX_LED_RED = 2,
};
#ifndef __cplusplus
typedef int32_t sw_rtex_led_t;
#endif // __cplusplus

/**
 * Cyclic codes, which are the control modes.
 */
enum sw_rtex_mode_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Nothing.
     */
    SW_RTEX_NOP = 0,
    /**
     * Profile position.
     */
    SW_RTEX_PP = 1,
    /**
     * Cyclic position.
     */
    SW_RTEX_CP = 2,
    /**
     * Cyclic velocity.
     */
    SW_RTEX_CV = 3,
    /**
     * Cyclic torque.
     */
    SW_RTEX_CT = 4,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_mode_t;
#endif // __cplusplus

/**
 * Non-cyclic codes.
 */
enum sw_rtex_noncyclic_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Normal.
     */
    SW_RTEX_NORMAL = 0,
    /**
     * Reset.
     */
    SW_RTEX_RESET = 1,
    /**
     * System ID.
     */
    SW_RTEX_SYSTEM_ID = 2,
    /**
     * Homing.
     */
    SW_RTEX_HOMING = 4,
    /**
     * Alarm.
     */
    SW_RTEX_ALARM_COMMAND = 5,
    /**
     * Parameter.
     */
    SW_RTEX_PARAMETER = 6,
    /**
     * Profile.
     */
    SW_RTEX_PROFILE = 7,
    /**
     * Monitor.
     */
    SW_RTEX_MONITOR = 10,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_noncyclic_t;
#endif // __cplusplus

/**
 * The phases of the control of a ring.
 */
enum sw_rtex_phase_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * PH_INIT.
     */
    SW_RTEX_PH_INIT = 0,
    /**
     * PH_WAITING.
     */
    SW_RTEX_PH_WAITING = 1,
    /**
     * PH_PREPARE.
     */
    SW_RTEX_PH_PREPARE = 2,
    /**
     * PH_START.
     */
    SW_RTEX_PH_START = 3,
    /**
     * PH_RUNNING.
     */
    SW_RTEX_PH_RUNNING = 4,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_phase_t;
#endif // __cplusplus

/**
 * Why an axis stops.
 */
enum sw_rtex_reason_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * It does not.
     */
    SW_RTEX_NO_REASON = 0,
    /**
     * No new echo.
     */
    SW_RTEX_ECHO_TIMEOUT = 1,
    /**
     * Another drive answers; the detail is its MAC-ID.
     */
    SW_RTEX_WRONG_MAC_ID = 2,
    /**
     * Blocks were refused; the detail is the number of the class.
     */
    SW_RTEX_REFUSED = 3,
    /**
     * No block.
     */
    SW_RTEX_RECEIVE_TIMEOUT = 4,
    /**
     * The drive reports an alarm.
     */
    SW_RTEX_ALARM = 5,
    /**
     * Servo_Ready went to 0.
     */
    SW_RTEX_NOT_READY = 6,
    /**
     * Servo_Active went to 0.
     */
    SW_RTEX_NOT_ACTIVE = 7,
    /**
     * Servo_Ready did not go to 1 in time.
     */
    SW_RTEX_READY_TIMEOUT = 8,
    /**
     * Servo_Active did not go to 1 in time.
     */
    SW_RTEX_ACTIVE_TIMEOUT = 9,
    /**
     * Servo_Active did not go to 0 in time.
     */
    SW_RTEX_INACTIVE_TIMEOUT = 10,
    /**
     * The drive does not accept the command; the detail is its error code.
     */
    SW_RTEX_COMMAND_ERROR = 11,
    /**
     * Another axis has failed; the detail is its place.
     */
    SW_RTEX_OTHER_AXIS = 12,
    /**
     * It was requested.
     */
    SW_RTEX_REQUESTED = 13,
    /**
     * Homing did not end in time.
     */
    SW_RTEX_HOMING_TIMEOUT = 14,
    /**
     * Another reason, added in a later release.
     */
    SW_RTEX_OTHER_REASON = 255,
};
#ifndef __cplusplus
typedef uint8_t sw_rtex_reason_t;
#endif // __cplusplus

/**
 * Status flags of a response, bytes 2 and 3.
 */
enum sw_rtex_status_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * In_Position.
     */
    SW_RTEX_IN_POSITION = (1 << 0),
    /**
     * In_Progress.
     */
    SW_RTEX_IN_PROGRESS = (1 << 1),
    /**
     * Homing_Complete.
     */
    SW_RTEX_HOMING_COMPLETE = (1 << 2),
    /**
     * Torque_Limited.
     */
    SW_RTEX_TORQUE_LIMITED = (1 << 3),
    /**
     * Warning.
     */
    SW_RTEX_WARNING = (1 << 4),
    /**
     * Alarm.
     */
    SW_RTEX_ALARM_FLAG = (1 << 5),
    /**
     * Servo_Ready.
     */
    SW_RTEX_SERVO_READY = (1 << 6),
    /**
     * Servo_Active: the motor is energised.
     */
    SW_RTEX_SERVO_ACTIVE = (1 << 7),
    /**
     * NOT.
     */
    SW_RTEX_NOT = (1 << 8),
    /**
     * POT.
     */
    SW_RTEX_POT = (1 << 9),
    /**
     * HOME.
     */
    SW_RTEX_HOME = (1 << 10),
    /**
     * SI-MON1.
     */
    SW_RTEX_SI_MON1 = (1 << 11),
    /**
     * SI-MON2.
     */
    SW_RTEX_SI_MON2 = (1 << 12),
    /**
     * SI-MON3.
     */
    SW_RTEX_SI_MON3 = (1 << 13),
    /**
     * SI-MON4.
     */
    SW_RTEX_SI_MON4 = (1 << 14),
    /**
     * SI-MON5.
     */
    SW_RTEX_SI_MON5 = (1 << 15),
};
#ifndef __cplusplus
typedef uint16_t sw_rtex_status_t;
#endif // __cplusplus

/**
 * Type codes that public documents give, by the command they belong to.
 */
enum sw_rtex_type_t
#ifdef __cplusplus
  : uint16_t
#endif // __cplusplus
 {
    /**
     * Reset: software reset; system ID: vendor name; monitor: position deviation.
     */
    SW_RTEX_TYPE_1 = 1,
    /**
     * Monitor: MPOS.
     */
    SW_RTEX_TYPE_MPOS = 4,
    /**
     * Monitor: ASPD; system ID: device type.
     */
    SW_RTEX_TYPE_5 = 5,
    /**
     * Monitor: TRQ.
     */
    SW_RTEX_TYPE_TRQ = 6,
    /**
     * Monitor: APOS.
     */
    SW_RTEX_TYPE_APOS = 7,
    /**
     * Monitor: IPOS.
     */
    SW_RTEX_TYPE_IPOS = 8,
    /**
     * Monitor: LPOS1.
     */
    SW_RTEX_TYPE_LPOS1 = 9,
    /**
     * Monitor: LPOS2.
     */
    SW_RTEX_TYPE_LPOS2 = 10,
    /**
     * Monitor: MSPD.
     */
    SW_RTEX_TYPE_MSPD = 12,
    /**
     * Reset: attribute C; parameter: write; profile: relative positioning; monitor: regenerative load.
     */
    SW_RTEX_TYPE_11H = 17,
    /**
     * System ID: model; monitor: overload.
     */
    SW_RTEX_TYPE_12H = 18,
    /**
     * System ID: serial number.
     */
    SW_RTEX_TYPE_SERIAL_NUMBER = 19,
    /**
     * System ID: software version.
     */
    SW_RTEX_TYPE_SOFTWARE_VERSION = 20,
    /**
     * System ID: driver type.
     */
    SW_RTEX_TYPE_DRIVER_TYPE = 21,
    /**
     * Homing: set the actual position.
     */
    SW_RTEX_TYPE_SET_ACTUAL_POSITION = 33,
    /**
     * Homing: set the command position.
     */
    SW_RTEX_TYPE_SET_COMMAND_POSITION = 34,
    /**
     * System ID: vendor of the scale.
     */
    SW_RTEX_TYPE_SCALE_VENDOR_ID = 49,
    /**
     * System ID: model of the scale.
     */
    SW_RTEX_TYPE_SCALE_MODEL_ID = 50,
    /**
     * Homing: state of the latches.
     */
    SW_RTEX_TYPE_LATCH_STATE = 80,
};
#ifndef __cplusplus
typedef uint16_t sw_rtex_type_t;
#endif // __cplusplus

/**
 * Refusals of SORTE frames, in the order of their numbers.
 */
enum sw_sorte_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * The frame is too short.
     */
    SW_E_SORTE_TRUNCATED = -1281,
    /**
     * The frame check sequence is wrong.
     */
    SW_E_SORTE_BAD_FCS = -1282,
    /**
     * The destination is not the one for all devices.
     */
    SW_E_SORTE_WRONG_DESTINATION = -1283,
    /**
     * The type is not defined, or its layout is not published.
     */
    SW_E_SORTE_UNKNOWN_TYPE = -1284,
    /**
     * The type is not the expected one.
     */
    SW_E_SORTE_UNEXPECTED_TYPE = -1285,
    /**
     * The frame is too long.
     */
    SW_E_SORTE_TOO_LONG = -1286,
    /**
     * The CRC-8 is wrong.
     */
    SW_E_SORTE_BAD_CRC8 = -1287,
    /**
     * The source is not the expected one.
     */
    SW_E_SORTE_WRONG_SOURCE = -1288,
    /**
     * The preamble is wrong.
     */
    SW_E_SORTE_BAD_PREAMBLE = -1289,
    /**
     * More devices than there are addresses.
     */
    SW_E_SORTE_TOO_MANY_DEVICES = -1290,
    /**
     * The table does not agree with its totals.
     */
    SW_E_SORTE_TABLE_MISMATCH = -1291,
    /**
     * The buffer is too small.
     */
    SW_E_SORTE_BUFFER_TOO_SMALL = -1294,
    /**
     * A PTO word that is reserved.
     */
    SW_E_SORTE_RESERVED_PTO_VALUE = -1295,
};
#ifndef __cplusplus
typedef int32_t sw_sorte_error_t;
#endif // __cplusplus

/**
 * The content of a PTO word.
 */
enum sw_sorte_pto_kind_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * No pulse in this cycle.
     */
    SW_SORTE_NO_PULSE = 0,
    /**
     * A pulse.
     */
    SW_SORTE_PULSE = 1,
    /**
     * The driver is switched off.
     */
    SW_SORTE_DRIVER_OFF = 2,
    /**
     * A reserved value.
     */
    SW_SORTE_RESERVED = 3,
};
#ifndef __cplusplus
typedef uint8_t sw_sorte_pto_kind_t;
#endif // __cplusplus

/**
 * Types of the frames with a long header.
 */
enum sw_sorte_type_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * DISCOVERY.
     */
    SW_SORTE_DISCOVERY_FRAME = 1,
    /**
     * PARAM.
     */
    SW_SORTE_PARAM_FRAME = 2,
    /**
     * DELAY_REQ.
     */
    SW_SORTE_DELAY_REQ_FRAME = 3,
    /**
     * DELAY_RESP.
     */
    SW_SORTE_DELAY_RESP_FRAME = 4,
    /**
     * SYNC.
     */
    SW_SORTE_SYNC_FRAME = 5,
};
#ifndef __cplusplus
typedef uint8_t sw_sorte_type_t;
#endif // __cplusplus

/**
 * Refusals of step-profile, in the order of their numbers.
 */
enum sw_step_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * 0 steps per entry.
     */
    SW_E_STEP_ZERO_SEGMENT_LENGTH = -1793,
    /**
     * Too many steps per entry.
     */
    SW_E_STEP_SEGMENT_TOO_LONG = -1794,
    /**
     * Two steps could fall into one cycle.
     */
    SW_E_STEP_STEP_RATE_TOO_HIGH = -1795,
    /**
     * The first step takes longer than 32 bits can count.
     */
    SW_E_STEP_STEP_TIME_OVERFLOW = -1796,
    /**
     * The sync time is not within a cycle.
     */
    SW_E_STEP_SYNC_TIME_OUT_OF_RANGE = -1797,
    /**
     * The frequency is too low.
     */
    SW_E_STEP_FREQUENCY_TOO_LOW = -1800,
};
#ifndef __cplusplus
typedef int32_t sw_step_error_t;
#endif // __cplusplus

/**
 * Bits of the address field ADF.
 */
enum sw_tformat_adf_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * The address, 0..126; 127 is the page register.
     */
    SW_TFORMAT_ADF_ADDRESS = 127,
    /**
     * The memory is busy.
     */
    SW_TFORMAT_ADF_BUSY = 128,
};
#ifndef __cplusplus
typedef uint8_t sw_tformat_adf_t;
#endif // __cplusplus

/**
 * Bits of the error byte ALMC.
 */
enum sw_tformat_almc_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Over-speed.
     */
    SW_TFORMAT_ALMC_OS = 1,
    /**
     * Full absolute status: the single-turn accuracy is not yet guaranteed.
     */
    SW_TFORMAT_ALMC_FS = 2,
    /**
     * Counting error.
     */
    SW_TFORMAT_ALMC_CE = 4,
    /**
     * Overflow of the multi-turn counter.
     */
    SW_TFORMAT_ALMC_OF = 8,
    /**
     * Over-heat.
     */
    SW_TFORMAT_ALMC_OH = 16,
    /**
     * Multi-turn error.
     */
    SW_TFORMAT_ALMC_ME = 32,
    /**
     * Battery error; the turns cannot be trusted.
     */
    SW_TFORMAT_ALMC_BE = 64,
    /**
     * Battery alarm: the voltage is low.
     */
    SW_TFORMAT_ALMC_BA = 128,
};
#ifndef __cplusplus
typedef uint8_t sw_tformat_almc_t;
#endif // __cplusplus

/**
 * Why a position must not be used.
 */
enum sw_tformat_doubt_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * It may be used.
     */
    SW_TFORMAT_NO_DOUBT = 0,
    /**
     * Nothing has been heard yet.
     */
    SW_TFORMAT_DOUBT_NEVER = 1,
    /**
     * It is too old.
     */
    SW_TFORMAT_DOUBT_OLD = 2,
    /**
     * The response carries no such position.
     */
    SW_TFORMAT_DOUBT_ABSENT = 3,
    /**
     * Information bits of SF are set: the fields are not where they should be.
     */
    SW_TFORMAT_DOUBT_SHIFTED = 4,
    /**
     * CA0 or CA1: the request was damaged.
     */
    SW_TFORMAT_DOUBT_REQUEST_DAMAGED = 5,
    /**
     * ENID names an encoder with other widths.
     */
    SW_TFORMAT_DOUBT_OTHER_ENCODER = 6,
    /**
     * Bits above the width are set.
     */
    SW_TFORMAT_DOUBT_UPPER_BITS = 7,
    /**
     * ALMC reports something that is not tolerated.
     */
    SW_TFORMAT_DOUBT_ALARMS = 8,
    /**
     * SF reports something that is not tolerated.
     */
    SW_TFORMAT_DOUBT_STATUS = 9,
    /**
     * Another reason, added in a later release.
     */
    SW_TFORMAT_DOUBT_OTHER = 255,
};
#ifndef __cplusplus
typedef int32_t sw_tformat_doubt_t;
#endif // __cplusplus

/**
 * Refusals of T-Format, in the order of their numbers. Fields count from 0, the control field.
 */
enum sw_tformat_error_t
#ifdef __cplusplus
  : int32_t
#endif // __cplusplus
 {
    /**
     * A start bit reads 1.
     */
    SW_E_TFORMAT_START_BIT = -257,
    /**
     * A delimiter reads 0.
     */
    SW_E_TFORMAT_DELIMITER = -258,
    /**
     * The frame is too short.
     */
    SW_E_TFORMAT_TRUNCATED = -259,
    /**
     * The sink code is not 0, 1, 0.
     */
    SW_E_TFORMAT_SINK_CODE = -260,
    /**
     * The parity of the control field is odd.
     */
    SW_E_TFORMAT_PARITY = -261,
    /**
     * The data ID is not one of the nine documented ones.
     */
    SW_E_TFORMAT_UNKNOWN_DATA_ID = -262,
    /**
     * The response answers another data ID.
     */
    SW_E_TFORMAT_CF_MISMATCH = -263,
    /**
     * The encoder refused the request.
     */
    SW_E_TFORMAT_REJECTED = -264,
    /**
     * The check field is wrong.
     */
    SW_E_TFORMAT_CRC = -265,
    /**
     * The response is for another EEPROM address.
     */
    SW_E_TFORMAT_ADDRESS_MISMATCH = -266,
    /**
     * The data byte differs from the one written.
     */
    SW_E_TFORMAT_DATA_MISMATCH = -267,
    /**
     * The request did not come back as sent.
     */
    SW_E_TFORMAT_ECHO_MISMATCH = -268,
    /**
     * No response came in time.
     */
    SW_E_TFORMAT_NO_RESPONSE = -269,
    /**
     * The EEPROM stayed busy.
     */
    SW_E_TFORMAT_BUSY = -270,
    /**
     * The act was not done: reading back shows it.
     */
    SW_E_TFORMAT_NOT_DONE = -271,
    /**
     * Whether the act was done is not known: read back before trying again.
     */
    SW_E_TFORMAT_EFFECT_UNKNOWN = -272,
    /**
     * A data field has bits above the width of the encoder.
     */
    SW_E_TFORMAT_UPPER_BITS = -273,
    /**
     * Two sound responses in one block.
     */
    SW_E_TFORMAT_TWO_RESPONSES = -275,
    /**
     * The settings of the line leave no time for a response.
     */
    SW_E_TFORMAT_LINE = -276,
};
#ifndef __cplusplus
typedef int32_t sw_tformat_error_t;
#endif // __cplusplus

/**
 * Data IDs (TIDM-1011, table 2-4).
 */
enum sw_tformat_id_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * ABS.
     */
    SW_TFORMAT_READ_SINGLE_TURN = 0,
    /**
     * ABM.
     */
    SW_TFORMAT_READ_MULTI_TURN = 1,
    /**
     * ENID.
     */
    SW_TFORMAT_READ_ENCODER_ID = 2,
    /**
     * ABS, ENID, ABM and ALMC.
     */
    SW_TFORMAT_READ_ALL = 3,
    /**
     * Writes a byte to the EEPROM.
     */
    SW_TFORMAT_WRITE_EEPROM = 6,
    /**
     * Clears errors; has to be sent ten times.
     */
    SW_TFORMAT_RESET_ERRORS = 7,
    /**
     * Makes this position the zero of the turn; has to be sent ten times. Shifts the commutation angle.
     */
    SW_TFORMAT_SET_SINGLE_TURN_ZERO = 8,
    /**
     * Clears turns and errors; has to be sent ten times. The machine loses its multi-turn reference.
     */
    SW_TFORMAT_RESET_TURNS_AND_ERRORS = 12,
    /**
     * Reads a byte of the EEPROM.
     */
    SW_TFORMAT_READ_EEPROM = 13,
};
#ifndef __cplusplus
typedef uint8_t sw_tformat_id_t;
#endif // __cplusplus

/**
 * Bits of the status field SF.
 */
enum sw_tformat_sf_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Counting error.
     */
    SW_TFORMAT_SF_EA0 = 16,
    /**
     * Over-heat, multi-turn error, battery error or battery alarm.
     */
    SW_TFORMAT_SF_EA1 = 32,
    /**
     * The request had a parity error.
     */
    SW_TFORMAT_SF_CA0 = 64,
    /**
     * The request had a delimiter error.
     */
    SW_TFORMAT_SF_CA1 = 128,
};
#ifndef __cplusplus
typedef uint8_t sw_tformat_sf_t;
#endif // __cplusplus

/**
 * Properties that the widths of an encoder leave open, for sw_tformat_set_resolution(); may be added.
 */
enum sw_tformat_turns_t
#ifdef __cplusplus
  : uint8_t
#endif // __cplusplus
 {
    /**
     * Turns count from 0 up; otherwise they are two's complement.
     */
    SW_TFORMAT_UNSIGNED_TURNS = 1,
    /**
     * Bits above the widths are cut off; otherwise a position that has such bits is in doubt.
     */
    SW_TFORMAT_UPPER_BITS_IGNORED = 2,
};
#ifndef __cplusplus
typedef uint8_t sw_tformat_turns_t;
#endif // __cplusplus

/**
 * The result of a call: 0 and above is good, below 0 is refused. The names are in `sw_code_t` and in the
 * `sw_..._error_t` of the protocols; `sw_text()` has a text for each.
 *
 * A refusal of a protocol is `-(256 * protocol + number)`. The numbers never change.
 */
typedef int32_t sw_result_t;

/**
 * A line with up to eight encoders of one kind: one request, the responses, and the newest position of each. Its content is
 * private; it may be copied. Only one context at a time may use it.
 */
typedef struct {
    uint64_t _private[112];
} sw_aformat_t;

/**
 * Widths of an encoder, and its factory settings.
 */
typedef struct {
    /**
     * Bits of the single turn.
     */
    uint8_t st_bits;
    /**
     * Bits of the turns; at most 40 together with those of the single turn.
     */
    uint8_t mt_bits;
    /**
     * sw_aformat_option_t, added.
     */
    uint8_t options;
} sw_aformat_encoder_t;

/**
 * The data to send, and when to send them.
 */
typedef struct {
    /**
     * When to start the first start bit.
     */
    uint64_t start_ns;
    /**
     * When the last delimiter ends.
     */
    uint64_t end_ns;
    /**
     * The content of the frames, the first bit of the line in bit 0.
     */
    uint16_t contents[4];
    /**
     * How many.
     */
    uint8_t len;
} sw_aformat_transmission_t;

/**
 * A response of an encoder. Fields that the layout does not have are 0.
 */
typedef struct {
    /**
     * Position bits as received, from bit 0 upwards; for ABS24H from bit 16 upwards.
     */
    uint64_t abs;
    /**
     * Velocity.
     */
    int32_t velocity;
    /**
     * EEPROM word, identification code or velocity coefficient.
     */
    uint32_t data;
    /**
     * ALM.
     */
    uint16_t alm;
    /**
     * Acceleration.
     */
    int16_t acceleration;
    /**
     * Temperature, 10 bits.
     */
    uint16_t temperature;
    /**
     * sw_aformat_layout_t.
     */
    uint8_t layout;
    /**
     * CC; 0 in ABS17, which does not have it.
     */
    uint8_t command;
    /**
     * EA.
     */
    uint8_t ea;
    /**
     * ES: sw_aformat_es_t. ABS17 has one bit for all of them: all or none are set.
     */
    uint8_t es;
    /**
     * PM-ALM.
     */
    uint8_t pm_alm;
    /**
     * EEPROM address.
     */
    uint8_t address;
    /**
     * EEPROM bank.
     */
    uint8_t bank;
} sw_aformat_response_t;

/**
 * A position that may be used.
 */
typedef struct {
    /**
     * Turns times the counts of a turn, plus the single turn.
     */
    int64_t counts;
    /**
     * When it was sampled.
     */
    uint64_t sampled_ns;
    /**
     * Counts in the turn.
     */
    uint32_t single_turn;
    /**
     * Turns.
     */
    int32_t turns;
} sw_position_t;

/**
 * A request of a master. Fields that the command does not take are ignored.
 */
typedef struct {
    /**
     * Data of a write: a word (command 14), an identification code (18, 19, 20), a coefficient (18 with frame code 3).
     */
    uint32_t data;
    /**
     * CC, 0..30.
     */
    uint8_t command;
    /**
     * EA, 0..7.
     */
    uint8_t ea;
    /**
     * Frame code: 3 for banks (13, 14) and the velocity coefficient (16, 18) of version 3.0, else 0.
     */
    uint8_t fc;
    /**
     * Address of commands 13 and 14.
     */
    uint8_t address;
    /**
     * Bank of commands 13 and 14 with frame code 3.
     */
    uint8_t bank;
} sw_aformat_request_t;

/**
 * A modelled encoder with one bank of EEPROM. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[92];
} sw_aformat_device_t;

/**
 * The response of an encoder, and when it is sent.
 */
typedef struct {
    /**
     * When the first start bit is on the line.
     */
    uint64_t start_ns;
    /**
     * When the last bit ends.
     */
    uint64_t end_ns;
    /**
     * The content of the frames, the first bit of the line in bit 0.
     */
    uint16_t contents[6];
    /**
     * How many.
     */
    uint8_t len;
} sw_aformat_answer_t;

/**
 * A frame of a request, with a command or with a byte of memory: only its place in the request tells which.
 */
typedef struct {
    /**
     * Frame code.
     */
    uint8_t fc;
    /**
     * 1: `byte` is sent, a byte of memory; 0: `ea` and `command` are.
     */
    uint8_t memory;
    /**
     * EA, of a command.
     */
    uint8_t ea;
    /**
     * CC, of a command.
     */
    uint8_t command;
    /**
     * The byte, of a memory frame. In a frame that was heard, all fields are filled in.
     */
    uint8_t byte;
} sw_aformat_frame_t;

/**
 * A receiver of consecutive responses from a line. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[16];
} sw_aformat_receiver_t;

/**
 * The responses to one request, without times. For control use sw_aformat_t, which knows how old a response is. Its content is
 * private; it may be copied.
 */
typedef struct {
    uint64_t _private[36];
} sw_aformat_bus_t;

/**
 * A procedure of several exchanges with one encoder: it says what to send, takes what is heard, and decides what to repeat. Its
 * content is private. While it runs, nothing else may use the line.
 */
typedef struct {
    uint64_t _private[80];
} sw_aformat_procedure_t;

/**
 * The content of the type word of the EEPROM.
 */
typedef struct {
    /**
     * Bits of the single turn; 255 for a code that is not defined.
     */
    uint8_t st_bits;
    /**
     * Bits of the turns; 255 for a code that is not defined.
     */
    uint8_t mt_bits;
    /**
     * Battery: 0 none, 1 separate, 2 common; 255 for a code that is not defined.
     */
    uint8_t battery;
    /**
     * The code of the resolution.
     */
    uint8_t resolution_code;
} sw_aformat_type_t;

/**
 * How long a request and its responses take on the line, ns, without the time that an encoder takes to turn around.
 */
typedef struct {
    /**
     * A frame.
     */
    uint32_t frame_ns;
    /**
     * A response.
     */
    uint32_t response_ns;
    /**
     * A request and one response.
     */
    uint32_t one_ns;
    /**
     * A request of one frame and the responses of all encoders asked.
     */
    uint32_t all_ns;
    /**
     * The gap between responses.
     */
    uint32_t gap_ns;
    /**
     * A bit, ps.
     */
    uint32_t bit_ps;
} sw_aformat_times_t;

/**
 * The response with the whole position.
 */
typedef struct {
    /**
     * Position bits as received, 40: the single turn in the low ones.
     */
    uint64_t abs;
    /**
     * EA: the address of the encoder that answers.
     */
    uint8_t ea;
    /**
     * ES: sw_aformat_es_t.
     */
    uint8_t es;
} sw_aformat_abs40_t;

/**
 * Nanoseconds from a free-running 32-bit timer that wraps. Only one context at a time may use it.
 */
typedef struct {
    uint64_t _private[6];
} sw_clock_t;

/**
 * A 10-bit word as a receiver reads it.
 */
typedef struct {
    /**
     * Its value; of a bad word what the rule makes of it.
     */
    uint8_t byte;
    /**
     * 1 for a special character.
     */
    uint8_t special;
    /**
     * 1: the word stands in neither column of the tables.
     */
    uint8_t byte_error;
} sw_hdsl_reading_t;

/**
 * An answer: its six words, and their content.
 */
typedef struct {
    /**
     * Vertical, parameter, pipe, two of the acceleration, secondary.
     */
    sw_hdsl_reading_t words[6];
    /**
     * SW_OK, or why the acceleration must not be used.
     */
    sw_result_t acceleration;
    /**
     * The parameter byte, 0..255, with VSYNC in bit 7, or why it cannot be read.
     */
    sw_result_t parameter;
    /**
     * Change of speed, steps; 0 unless `acceleration` is SW_OK.
     */
    int16_t delta_delta;
    /**
     * The switch bit is right.
     */
    uint8_t switch_ok;
} sw_hdsl_answer_t;

/**
 * A character of 8b/10b.
 */
typedef struct {
    /**
     * Its value.
     */
    uint8_t byte;
    /**
     * 1 for a special character (K), 0 for data (D).
     */
    uint8_t special;
} sw_hdsl_character_t;

/**
 * The parts of an answer.
 */
typedef struct {
    /**
     * Change of speed, -1024..1023 steps.
     */
    int16_t delta_delta;
    /**
     * 1: the encoder has a value for this frame; 0: K29.7 K29.7 are sent in its place.
     */
    uint8_t accelerated;
    /**
     * Data byte of the vertical channel.
     */
    uint8_t vertical;
    /**
     * Parameter byte.
     */
    uint8_t parameter;
    /**
     * Pipe channel.
     */
    sw_hdsl_character_t pipe;
    /**
     * Secondary channel.
     */
    sw_hdsl_character_t secondary;
} sw_hdsl_content_t;

/**
 * A safe position with what came around it: as received, not yet a valid position.
 */
typedef struct {
    /**
     * Position, 40 bits.
     */
    uint64_t vpos;
    /**
     * SW_OK, or why the block must not be used.
     */
    sw_result_t result;
    /**
     * CRC as received.
     */
    uint16_t crc;
    /**
     * Status byte.
     */
    uint8_t status;
} sw_hdsl_safe_t;

/**
 * The two safe positions of a V-frame.
 */
typedef struct {
    /**
     * Safe channel 1, from the vertical words.
     */
    sw_hdsl_safe_t safe1;
    /**
     * Safe channel 2, from the secondary words.
     */
    sw_hdsl_safe_t safe2;
} sw_hdsl_v_frame_t;

/**
 * A modelled encoder. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[54];
} sw_hdsl_device_t;

/**
 * What is to be sent from the start of an H-frame.
 */
typedef struct {
    /**
     * SYNC to PARA, the first bit of the line in bit 0 of byte 0.
     */
    uint8_t head[16];
    /**
     * Bits of it.
     */
    uint8_t head_bits;
    /**
     * Zeros before the frame.
     */
    uint8_t lead_in;
    /**
     * 1: an encoder answers; the line is released after PARA, and reception begins one bit later. 0: filler is sent.
     */
    uint8_t answered;
} sw_hdsl_transmission_t;

/**
 * The arithmetic of the fast position. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[14];
} sw_hdsl_tracker_t;

/**
 * Registers of the fast position.
 */
typedef struct {
    /**
     * POS, 40 bits.
     */
    uint64_t pos;
    /**
     * VEL, steps an H-frame.
     */
    int32_t vel;
    /**
     * Words in a row that could not be used.
     */
    uint32_t acc_err_cnt;
    /**
     * The event POS: the fast position is not the safe one.
     */
    uint8_t pos_flag;
    /**
     * sw_hdsl_stage_t.
     */
    uint8_t stage;
} sw_hdsl_position_registers_t;

/**
 * A quality monitor. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[2];
} sw_hdsl_quality_t;

/**
 * SYNC to PARA.
 */
typedef struct {
    /**
     * The first bit of the line in bit 0 of byte 0.
     */
    uint8_t bits[16];
    /**
     * PARA: the parameter byte, coded.
     */
    uint16_t para;
    /**
     * Bits of the head.
     */
    uint8_t len;
    /**
     * The four bits that level the line.
     */
    uint8_t equalisation;
    /**
     * Ones minus zeros of the line after it, without an answer.
     */
    int8_t disparity;
} sw_hdsl_head_t;

/**
 * The window and the stuffing of a synchronised frame.
 */
typedef struct {
    /**
     * TIME_EXTRA_WINDOW in eighths of a bit.
     */
    int16_t window;
    /**
     * Where the sampling edge stands in the window, 24..72 eighths.
     */
    uint8_t edge;
    /**
     * NUM_STUFFING: blocks of six bits after the previous frame, 0..26.
     */
    uint8_t stuffing;
    /**
     * EXTRA_EDGE, the register: ones as the edge has them.
     */
    uint8_t edge_register;
} sw_hdsl_extra_t;

/**
 * A short message: a register of the encoder is read or written.
 */
typedef struct {
    /**
     * Address, 40h..7Fh.
     */
    uint8_t register_address;
    /**
     * 1: write, 0: read.
     */
    uint8_t write;
    /**
     * The value to write.
     */
    uint8_t value;
} sw_hdsl_short_t;

/**
 * A long message: a resource of the encoder is read or written.
 */
typedef struct {
    /**
     * Address of the resource, 10 bits.
     */
    uint16_t address;
    /**
     * Offset, 15 bits; SW_HDSL_NO_OFFSET for none.
     */
    uint16_t offset;
    /**
     * 1: write, 0: read.
     */
    uint8_t write;
    /**
     * 1: indirect addressing.
     */
    uint8_t indirect;
    /**
     * Bytes to be read or written: 0, 2, 4 or 8.
     */
    uint8_t len;
    /**
     * The value to write.
     */
    uint8_t data[8];
} sw_hdsl_long_t;

/**
 * The data of an answer. Of SW_E_HDSL_RESOURCE they are the error code of the encoder: detail, then class.
 */
typedef struct {
    /**
     * Bytes of it.
     */
    uint8_t len;
    /**
     * The bytes, 0 after them.
     */
    uint8_t data[8];
} sw_hdsl_data_t;

/**
 * A receiver: start-up, link, newest positions. Its content is private; it may be copied. Only one context
 * at a time may use it.
 */
typedef struct {
    uint64_t _private[84];
} sw_hdsl_t;

/**
 * How the messages that ended in the last H-frame ended.
 */
typedef struct {
    /**
     * SW_PENDING: none ended; SW_OK, or why it failed.
     */
    sw_result_t short_result;
    /**
     * The same for the long message.
     */
    sw_result_t long_result;
    /**
     * The result of the long message.
     */
    sw_hdsl_data_t data;
    /**
     * The register of the short message.
     */
    uint8_t register_address;
    /**
     * The value read; 0 after a write.
     */
    uint8_t value;
} sw_hdsl_finished_t;

/**
 * A fast position that may be used.
 */
typedef struct {
    /**
     * Steps, turns included.
     */
    int64_t position;
    /**
     * When it was sampled.
     */
    uint64_t sampled_ns;
    /**
     * Steps in the last H-frame.
     */
    int32_t velocity;
    /**
     * The angle in the turn, a turn is 2^32; 0 if the steps of a turn were not told.
     */
    uint32_t angle;
} sw_hdsl_position_t;

/**
 * How the last H-frame heard continues, and what it brought besides the positions.
 */
typedef struct {
    /**
     * What to drive after the answer (TRAILER, then stuffing), the first bit of the line in bit 0 of byte
     * 0.
     */
    uint8_t tail[24];
    /**
     * Bits of it.
     */
    uint8_t tail_bits;
    /**
     * Bits of TRAILER in which the line idles before it.
     */
    uint8_t tail_idle;
    /**
     * sw_hdsl_restart_t: set if the next frame begins a new start-up.
     */
    uint8_t restarted;
    /**
     * 1: the start-up broke off in a LEARN frame, and only the zeros of TRAILER are driven.
     */
    uint8_t cut;
    /**
     * Quality monitor, 0..15.
     */
    uint8_t quality;
    /**
     * RSSI of this answer, 0..12; 255 if it was not measured.
     */
    uint8_t rssi;
    /**
     * 1: no short message is in progress.
     */
    uint8_t short_free;
    /**
     * 1: no long message is in progress.
     */
    uint8_t long_free;
    /**
     * The word of the pipe channel: its byte; -1 for none (K30.7), -2 for a word in no table.
     */
    int16_t pipe;
    /**
     * 1: it is a special character.
     */
    uint8_t pipe_special;
    /**
     * Acceleration words in a row that could not be used.
     */
    uint32_t acceleration_errors;
    /**
     * Restarts of the link since the start.
     */
    uint32_t restarts;
} sw_hdsl_frame_t;

/**
 * Registers of a receiver. Its content is private; it may be copied. Only one context at a time may use it.
 */
typedef struct {
    uint64_t _private[64];
} sw_hdsl_registers_t;

/**
 * The FIFO of eight bytes that PIPE_S and PIPE_D read. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[5];
} sw_hdsl_pipe_t;

/**
 * Where the bits of an answer are sampled.
 */
typedef struct {
    /**
     * The sample of a bit, 0..7.
     */
    uint8_t index;
    /**
     * The delay of the cable, 0..11 bits.
     */
    uint8_t delay;
} sw_hdsl_alignment_t;

/**
 * The background end. It belongs to its queue: it is not copied.
 */
typedef struct {
    uint64_t _private[1248];
} sw_motion_axis_t;

/**
 * The interrupt end. It belongs to its queue: it is not copied.
 */
typedef struct {
    uint64_t _private[9];
} sw_motion_timer_t;

/**
 * The queue between the background and the interrupt. It is `static`: both ends hold its address, and it
 * is never moved or copied.
 */
typedef struct {
    uint64_t _private[656];
} sw_motion_queue_t;

/**
 * How fast an axis may go.
 */
typedef struct {
    /**
     * Steps/s³; 0 for a trapezoid.
     */
    uint64_t jerk;
    /**
     * Steps/s.
     */
    uint32_t speed;
    /**
     * Steps/s².
     */
    uint32_t acceleration;
} sw_motion_limits_t;

/**
 * What an axis is. What is not needed is 0.
 */
typedef struct {
    /**
     * How fast it may go.
     */
    sw_motion_limits_t limits;
    /**
     * The range that no target may leave, both ends included, in steps; sw_motion_run() stops at its end. Both
     * 0: there is none. They do not count in a homing.
     */
    int64_t soft_low;
    /**
     * Its other end.
     */
    int64_t soft_high;
    /**
     * Ticks of the timer in a second, 1000 to 2^30 - 1.
     */
    uint32_t clock_hz;
    /**
     * Ticks between two steps in different directions, at least.
     */
    uint32_t reversal_pause;
    /**
     * A request takes effect after at most twice so many ticks, at least 16. 0: 10 ms.
     */
    uint32_t reach;
} sw_motion_setup_t;

/**
 * What the interrupt has to do.
 */
typedef struct {
    /**
     * Ticks until the next interrupt, at least 1: add them to the compare register. 0: there is none; stop
     * the timer.
     */
    uint32_t wait;
    /**
     * 1: make a step now. DIR has been valid for the time that the driver needs.
     */
    uint8_t step;
    /**
     * The level of DIR from now on, 1 for reverse. It never changes together with a step.
     */
    uint8_t reverse;
} sw_motion_fired_t;

/**
 * A homing.
 */
typedef struct {
    uint64_t _private[16];
} sw_motion_homing_t;

/**
 * How an axis looks for its switch.
 */
typedef struct {
    /**
     * Limits for the stop at the switch, beyond which there must be room to come to rest.
     */
    sw_motion_limits_t stop;
    /**
     * Speed of the search, in steps/s.
     */
    uint32_t seek;
    /**
     * Speed of the second, exact approach, in steps/s.
     */
    uint32_t approach;
    /**
     * How far to back off before that, in steps: farther than the stop at the switch takes and what the axis makes
     * in twice its reach before, or the switch stays closed.
     */
    uint32_t back_off;
    /**
     * After this many steps without a switch the search is abandoned.
     */
    uint32_t range;
    /**
     * Where the switch is: 1 in reverse, 0 forward.
     */
    uint8_t reverse;
} sw_motion_homing_setup_t;

/**
 * A receiver of start-stop fields from an oversampled line. Its content is private.
 */
typedef struct {
    uint64_t _private[9];
} sw_nrz_t;

/**
 * A field that was received.
 */
typedef struct {
    /**
     * The sample with which its start bit begins, from the first of the line.
     */
    uint64_t start;
    /**
     * Spikes that were dropped before it.
     */
    uint32_t spikes;
    /**
     * The data bits, first of the line in bit 0.
     */
    uint16_t content;
    /**
     * The level of its delimiter: 1 in a sound field.
     */
    uint8_t delimiter;
} sw_nrz_field_t;

/**
 * One axis of the ring: its drive's state, echo, limits and set-point. Its content is private; it may be
 * copied. Only one context at a time may use it.
 */
typedef struct {
    uint64_t _private[62];
} sw_rtex_axis_t;

/**
 * The configuration of an axis. Limits are counted in update periods.
 */
typedef struct {
    /**
     * Update period, ns.
     */
    uint32_t update_ns;
    /**
     * Update periods of invalid data at the start; 0 if they were already sent elsewhere.
     */
    uint32_t invalid;
    /**
     * Waits for Servo_Active, for an answer, for a stop.
     */
    uint32_t wait;
    /**
     * Wait for Servo_Ready; 0 waits for ever.
     */
    uint32_t ready;
    /**
     * Wait for Servo_Active to go; 0 is `wait`.
     */
    uint32_t inactive;
    /**
     * Electronic gear of the drive, numerator.
     */
    uint32_t gear_numerator;
    /**
     * Electronic gear of the drive, denominator.
     */
    uint32_t gear_denominator;
    /**
     * Responses without a new echo after which the axis stops, 1 or more.
     */
    uint16_t echo;
    /**
     * Responses with CMD_Error after which it stops, 1 or more.
     */
    uint16_t command_errors;
    /**
     * MAC-ID, 0..31.
     */
    uint8_t mac_id;
    /**
     * sw_rtex_mode_t.
     */
    uint8_t mode;
} sw_rtex_config_t;

/**
 * The state of an axis.
 */
typedef struct {
    /**
     * MAC-ID that answered, class of the refusal, place of another axis, or error code of the drive, if
     * the reason has one.
     */
    uint16_t detail;
    /**
     * sw_rtex_axis_code_t.
     */
    uint8_t code;
    /**
     * sw_rtex_reason_t.
     */
    uint8_t reason;
} sw_rtex_state_of_t;

/**
 * Feedback that may be used.
 */
typedef struct {
    /**
     * When the block was heard.
     */
    uint64_t sampled_ns;
    /**
     * Actual position in command units.
     */
    int32_t position;
} sw_rtex_feedback_t;

/**
 * What a drive sends: as received, not yet a valid position.
 */
typedef struct {
    /**
     * Response_Data1.
     */
    int32_t response_data1;
    /**
     * Status flags: sw_rtex_status_t; byte 2 is the low one.
     */
    uint16_t status;
    /**
     * Bytes 8 to 15, as the non-cyclic response lays them out.
     */
    uint8_t data[8];
    /**
     * Actual_MAC-ID.
     */
    uint8_t mac_id;
    /**
     * Update_Counter_Echo.
     */
    uint8_t update_counter_echo;
    /**
     * CMD_Error, 0 or 1.
     */
    uint8_t cmd_error;
    /**
     * Cyclic code, 0..15.
     */
    uint8_t cyclic;
    /**
     * Non-cyclic code, 0..7.
     */
    uint8_t noncyclic;
} sw_rtex_response_t;

/**
 * A command of a controller.
 */
typedef struct {
    /**
     * Command_Data1.
     */
    int32_t command_data1;
    /**
     * Control bits: sw_rtex_control_t; byte 2 is the low one.
     */
    uint16_t control;
    /**
     * Bytes 8 to 15, as the non-cyclic command lays them out.
     */
    uint8_t data[8];
    /**
     * Mac-ID, 0..31.
     */
    uint8_t mac_id;
    /**
     * Update_Counter, 0..3.
     */
    uint8_t update_counter;
    /**
     * TMG_CNT, 0 or 1.
     */
    uint8_t tmg_cnt;
    /**
     * Cyclic code: sw_rtex_mode_t, 0 for NOP.
     */
    uint8_t cyclic;
    /**
     * Non-cyclic code.
     */
    uint8_t noncyclic;
} sw_rtex_command_t;

/**
 * The sub block of a command, bytes 16 to 31.
 */
typedef struct {
    /**
     * Sub_Command_Data1.
     */
    int32_t data1;
    /**
     * Sub_Command_Data2.
     */
    int32_t data2;
    /**
     * Sub_Command_Data3.
     */
    int32_t data3;
    /**
     * Sub_Index.
     */
    uint16_t index;
    /**
     * Sub-command code: 0 normal, 2 system ID, 10 monitor.
     */
    uint8_t code;
    /**
     * Sub_Type_Code.
     */
    uint8_t type_code;
} sw_rtex_sub_command_t;

/**
 * The sub block of a response, bytes 16 to 31.
 */
typedef struct {
    /**
     * Sub_Response_Data1.
     */
    int32_t data1;
    /**
     * Sub_Response_Data2.
     */
    int32_t data2;
    /**
     * Sub_Response_Data3.
     */
    int32_t data3;
    /**
     * Sub_Index_Echo, or Sub_Error_Code with Sub_CMD_Error.
     */
    uint16_t index;
    /**
     * Sub-command code, 0..15.
     */
    uint8_t code;
    /**
     * Sub_Type_Code_Echo.
     */
    uint8_t type_code;
    /**
     * Sub_CMD_Error, 0 or 1.
     */
    uint8_t cmd_error;
    /**
     * sw_rtex_execution_t, added.
     */
    uint8_t execution;
} sw_rtex_sub_response_t;

/**
 * The phases of the control. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[2];
} sw_rtex_phases_t;

/**
 * What the phases depend on.
 */
typedef struct {
    /**
     * sw_rtex_asic_t.
     */
    uint8_t asic;
    /**
     * The slaves that were found are those of the table: 1, they are not: 0; not compared yet: 2.
     */
    uint8_t slave_info;
    /**
     * 1: the first commands are prepared.
     */
    uint8_t tx_ready;
    /**
     * 1: the communication has timed out.
     */
    uint8_t timeout;
} sw_rtex_inputs_t;

/**
 * Periods of the communication.
 */
typedef struct {
    /**
     * Communication period, ns.
     */
    uint32_t com_ns;
    /**
     * Update period, ns.
     */
    uint32_t update_ns;
    /**
     * 1: the internal-timer system may be used.
     */
    uint8_t internal_timer;
} sw_rtex_periods_t;

/**
 * A modelled drive that obeys commands and moves a simple axis. Its content is private; it may be copied. Type codes that no public document
 * gives are invented.
 */
typedef struct {
    uint64_t _private[84];
} sw_rtex_drive_t;

/**
 * A non-cyclic command in progress. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[6];
} sw_rtex_handshake_t;

/**
 * How a procedure ended.
 */
typedef struct {
    /**
     * The value read: Monitor_Data, Response_Data3 or Sub_Response_Data1; 0 for none.
     */
    int32_t data;
    /**
     * Index_Echo, of a profile motion 0. With SW_E_RTEX_COMMAND_ERROR the error code of the drive.
     */
    uint16_t index;
    /**
     * 1: done, with a restriction (WNG).
     */
    uint8_t warning;
    /**
     * 1: a profile motion ended in position.
     */
    uint8_t in_position;
} sw_rtex_done_t;

/**
 * A sub-command in progress. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[4];
} sw_rtex_sub_handshake_t;

/**
 * A profile motion in progress. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[10];
} sw_rtex_move_t;

/**
 * The common state of the axes of a ring. Its content is private; it may be copied. Only one context at a
 * time may use it.
 */
typedef struct {
    uint64_t _private[5];
} sw_rtex_ring_t;

/**
 * The faults that a drive finds in a command.
 */
typedef struct {
    /**
     * Error code of the main half, 0 for none.
     */
    uint16_t error;
    /**
     * Error code of the sub half, 0 for none.
     */
    uint16_t sub_error;
    /**
     * Main number of the alarm that repetitions raise, 0 for none.
     */
    uint8_t alarm_main;
    /**
     * Its sub number.
     */
    uint8_t alarm_sub;
} sw_rtex_verdict_t;

/**
 * An echo watch. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[4];
} sw_rtex_echo_t;

/**
 * The counter of the commands. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[2];
} sw_rtex_counter_t;

/**
 * A frame from the master: its output begins at SW_SORTE_DATA_AT.
 */
typedef struct {
    /**
     * Time stamp of its transmission, ns.
     */
    uint16_t time_stamp;
    /**
     * STATUS.
     */
    uint8_t status;
} sw_sorte_master_frame_t;

/**
 * A frame from a device: its payload begins at SW_SORTE_DATA_AT.
 */
typedef struct {
    /**
     * Address of the sender.
     */
    uint8_t address;
    /**
     * STATUS: LAST and ERROR.
     */
    uint8_t status;
} sw_sorte_device_frame_t;

/**
 * A PTO word.
 */
typedef struct {
    /**
     * Start of the pulse in the cycle, ns; 0 without one. Of a reserved word: its time, which must not be used.
     */
    uint16_t start_ns;
    /**
     * sw_sorte_pto_kind_t.
     */
    uint8_t kind;
    /**
     * DIR, 0 or 1; 0 if the driver is off.
     */
    uint8_t direction;
} sw_sorte_pto_t;

/**
 * The header of a frame of the start-up; its payload begins at byte 4.
 */
typedef struct {
    /**
     * SA.
     */
    uint8_t source;
    /**
     * sw_sorte_type_t.
     */
    uint8_t frame_type;
    /**
     * STATUS.
     */
    uint8_t status;
    /**
     * Bytes of the payload.
     */
    uint16_t payload_len;
} sw_sorte_header_t;

/**
 * The content of a PARAM frame, for all devices.
 */
typedef struct {
    /**
     * Cycle time, ns.
     */
    uint32_t cycle_time_ns;
    /**
     * SYNC_CYCLE.
     */
    uint32_t sync_cycle;
    /**
     * DELAY_FWD_TIME, ns.
     */
    uint32_t delay_fwd_time_ns;
    /**
     * IPG, 5 ns.
     */
    uint32_t ipg_5ns;
    /**
     * T_IN, ns.
     */
    uint32_t t_in_ns;
    /**
     * T_OUT, ns.
     */
    uint32_t t_out_ns;
    /**
     * DELAY_PERIOD, ms.
     */
    uint16_t delay_period_ms;
    /**
     * DELAY_BURST.
     */
    uint8_t delay_burst;
    /**
     * DELAY_GAP, ms.
     */
    uint8_t delay_gap_ms;
    /**
     * TOPOLOGY.
     */
    uint8_t topology;
    /**
     * DIAGNOSTICS.
     */
    uint8_t diagnostics;
    /**
     * ALARM.
     */
    uint8_t alarm;
    /**
     * CRC_MODE: low nibble output, high nibble input.
     */
    uint8_t crc_mode;
    /**
     * SA, of the frame.
     */
    uint8_t source;
    /**
     * STATUS, of the frame.
     */
    uint8_t status;
} sw_sorte_param_t;

/**
 * A SYNC frame.
 */
typedef struct {
    /**
     * Master time at which its start is expected at the receiver, ns.
     */
    uint32_t time_stamp_ns;
    /**
     * Delay from the master to the receiver, ns.
     */
    uint16_t delay_ns;
    /**
     * SA.
     */
    uint8_t source;
    /**
     * STATUS.
     */
    uint8_t status;
} sw_sorte_sync_t;

/**
 * A DISCOVERY frame, without its table.
 */
typedef struct {
    /**
     * Devices that have passed it on.
     */
    uint16_t count;
    /**
     * Bytes from all devices.
     */
    uint16_t input_total;
    /**
     * Bytes to all devices.
     */
    uint16_t output_total;
    /**
     * SA.
     */
    uint8_t source;
    /**
     * STATUS.
     */
    uint8_t status;
} sw_sorte_discovery_t;

/**
 * When a step comes.
 */
typedef struct {
    /**
     * Cycles of 4 us to wait.
     */
    uint32_t cnt;
    /**
     * Time in that cycle, ns.
     */
    uint32_t sync;
} sw_step_time_t;

/**
 * A move with a ramp.
 */
typedef struct {
    /**
     * Steps of the move.
     */
    uint32_t steps;
    /**
     * Speed constant: sw_step_speed().
     */
    uint32_t speed;
    /**
     * Steps per entry.
     */
    uint32_t k;
    /**
     * Where the first step comes in its cycle, ns.
     */
    uint32_t init_sync;
    /**
     * 1: as the PRU computes it, its errors included; 0: without them.
     */
    uint8_t as_pru;
} sw_step_move_t;

/**
 * The course of a move.
 */
typedef struct {
    /**
     * How long it takes, ns.
     */
    uint64_t duration_ns;
    /**
     * Steps of the ramp up.
     */
    uint32_t accelerating;
    /**
     * Steps at full speed.
     */
    uint32_t constant;
    /**
     * Steps of the ramp down.
     */
    uint32_t decelerating;
    /**
     * 1: the PRU computes it without error.
     */
    uint8_t pru_is_exact;
} sw_step_shape_t;

/**
 * A step of a move with a ramp.
 */
typedef struct {
    /**
     * Cycle of 4 us in which it comes, from the first of the move.
     */
    uint64_t cycle;
    /**
     * Time since the previous step, ns.
     */
    uint32_t t_step;
    /**
     * Time in its cycle, ns.
     */
    uint32_t sync_time;
    /**
     * Entry of the ramp.
     */
    uint8_t entry;
} sw_step_step_t;

/**
 * What a micro-step profile of the published application does with a motor of 200 full steps a turn.
 */
typedef struct {
    /**
     * Micro-steps a full step.
     */
    uint32_t microsteps;
    /**
     * Steps of a quarter turn.
     */
    uint32_t quarter_turn;
    /**
     * Steps of a turn.
     */
    uint32_t turn;
    /**
     * Steps of ten turns.
     */
    uint32_t ten_turns;
    /**
     * The mode bits of the DRV8711's CTRL register, in their place.
     */
    uint16_t ctrl_field;
} sw_step_microstep_t;

/**
 * A tone that the motors play.
 */
typedef struct {
    /**
     * Speed constant: sw_step_speed().
     */
    uint32_t speed;
    /**
     * Steps of 125 ms.
     */
    uint32_t p125;
    /**
     * Steps of 250 ms.
     */
    uint32_t p250;
    /**
     * Step frequency in Hz, exactly: this by `denominator`.
     */
    uint32_t numerator;
    /**
     * See `numerator`.
     */
    uint16_t denominator;
    /**
     * The tone in 0.1 Hz, cut.
     */
    uint16_t tenths_hz;
} sw_step_tone_t;

/**
 * A request of a master.
 */
typedef struct {
    /**
     * Data ID: sw_tformat_id_t.
     */
    uint8_t id;
    /**
     * Address field of IDs 6 and D.
     */
    uint8_t adf;
    /**
     * Data field of ID 6.
     */
    uint8_t edf;
} sw_tformat_request_t;

/**
 * A response of an encoder. Fields that the response to this data ID does not have are 0.
 */
typedef struct {
    /**
     * Single-turn data, 24 bits, right-aligned: as received, not yet a valid position.
     */
    uint32_t abs;
    /**
     * Multi-turn data, 24 bits, as received.
     */
    uint32_t abm;
    /**
     * Data ID: sw_tformat_id_t.
     */
    uint8_t id;
    /**
     * Status field: sw_tformat_sf_t.
     */
    uint8_t sf;
    /**
     * Encoder ID.
     */
    uint8_t enid;
    /**
     * Error byte: sw_tformat_almc_t.
     */
    uint8_t almc;
    /**
     * Address field: sw_tformat_adf_t.
     */
    uint8_t adf;
    /**
     * Data field of the EEPROM.
     */
    uint8_t edf;
} sw_tformat_response_t;

/**
 * Where a frame is wrong, and in what way.
 */
typedef struct {
    /**
     * The value received: a byte, or a count of fields; 0 if the error has none.
     */
    uint32_t got;
    /**
     * The value expected, or the bits that must be 0.
     */
    uint32_t want;
    /**
     * The field in which the fault shows, 0 for the control field; 255 if it is not in one field.
     */
    uint8_t field;
    /**
     * The first wrong bit of that field: 0 is the start bit, 1 to 8 are data, 9 is the delimiter; 255 if it cannot be told.
     */
    uint8_t bit;
} sw_detail_t;

/**
 * A modelled encoder with six pages of EEPROM. Its content is private; it may be copied.
 */
typedef struct {
    uint64_t _private[128];
} sw_tformat_device_t;

/**
 * The response of an encoder, and when it is sent.
 */
typedef struct {
    /**
     * When the first start bit is on the line.
     */
    uint64_t start_ns;
    /**
     * When the last bit ends.
     */
    uint64_t end_ns;
    /**
     * The fields, one byte each.
     */
    uint8_t bytes[11];
    /**
     * How many.
     */
    uint8_t len;
} sw_tformat_answer_t;

/**
 * A master: the line, one request and its response, and the newest position. Its content is private; it may be copied.
 *
 * One context at a time: an interrupt that calls it while another call runs is a race.
 */
typedef struct {
    uint64_t _private[36];
} sw_tformat_t;

/**
 * The times of a line, in ns: sw_tformat_get_line() returns the defaults; change those that differ.
 */
typedef struct {
    /**
     * 2500000 or 5000000.
     */
    uint32_t bits_per_second;
    /**
     * Longest time from the end of the request to the start bit of the response; default 10 000.
     */
    uint32_t response_timeout_ns;
    /**
     * Longest time from the end of a field to the end of the next; default one and a half field times.
     */
    uint32_t field_timeout_ns;
    /**
     * Shortest time from the end of the request to the start bit of the response; default four bits.
     */
    uint32_t turn_around_ns;
    /**
     * Longest time from the end of a byte to its hand-over: interrupt latency, or the time after which an
     * idle line is reported.
     */
    uint32_t hand_over_ns;
    /**
     * The driver is on for this time before the request; default 1000.
     */
    uint32_t driver_lead_ns;
    /**
     * From the end of the request to the instant at which the position is taken; default 480.
     */
    uint32_t sampling_ns;
    /**
     * 1 if the request itself is received too: this makes the errors clearer, and nothing else depends on
     * it.
     */
    uint8_t echo;
} sw_tformat_line_t;

/**
 * The data to send, and when to send them.
 */
typedef struct {
    /**
     * When to start the start bit.
     */
    uint64_t start_ns;
    /**
     * When the last bit ends.
     */
    uint64_t end_ns;
    /**
     * When the driver is to be switched on.
     */
    uint64_t driver_on_ns;
    /**
     * When to switch the driver off at the latest; `end_ns` is the earliest.
     */
    uint64_t driver_off_ns;
    /**
     * The fields, one byte each.
     */
    uint8_t bytes[4];
    /**
     * How many.
     */
    uint8_t len;
} sw_tformat_transmission_t;

/**
 * A procedure of several exchanges: it says what to send, and decides what to repeat. Its content is private.
 */
typedef struct {
    uint64_t _private[20];
} sw_tformat_procedure_t;

/**
 * ID 0.
 */
typedef struct {
    /**
     * Single-turn data, 24 bits, as received.
     */
    uint32_t abs;
    /**
     * Status field: sw_tformat_sf_t.
     */
    uint8_t sf;
} sw_tformat_single_turn_t;

/**
 * ID 1.
 */
typedef struct {
    /**
     * Multi-turn data, 24 bits, as received.
     */
    uint32_t abm;
    /**
     * Status field: sw_tformat_sf_t.
     */
    uint8_t sf;
} sw_tformat_multi_turn_t;

/**
 * ID 2.
 */
typedef struct {
    /**
     * Status field: sw_tformat_sf_t.
     */
    uint8_t sf;
    /**
     * Encoder ID.
     */
    uint8_t enid;
} sw_tformat_encoder_id_t;

/**
 * ID 3.
 */
typedef struct {
    /**
     * Single-turn data, 24 bits, as received.
     */
    uint32_t abs;
    /**
     * Multi-turn data, 24 bits, as received.
     */
    uint32_t abm;
    /**
     * Status field: sw_tformat_sf_t.
     */
    uint8_t sf;
    /**
     * Encoder ID.
     */
    uint8_t enid;
    /**
     * Error byte: sw_tformat_almc_t.
     */
    uint8_t almc;
} sw_tformat_all_t;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Prepares a line: bits per second (2500000, 4000000, 6666667, 8000000 or 16000000), and the properties of
 * its encoders.
 */
sw_result_t sw_aformat_init(sw_aformat_t *m, uint32_t bits_per_second, const sw_aformat_encoder_t *encoder);

/**
 * Sets the longest time from the end of a frame to its hand-over, ns, and the highest address on the line,
 * 0..7.
 */
sw_result_t sw_aformat_set_hand_over(sw_aformat_t *m, uint32_t hand_over_ns, uint8_t highest_ea);

/**
 * Begins a request to all encoders whose bit is set in `asked` (bit 0 is EA 0). Only commands that read
 * (0..7, 21..30) are sent this way; those with a single answer are sent to one encoder. SW_SEND with
 * `to_send` filled; SW_E_NOT_FREE while an exchange is pending, and before the time of
 * sw_aformat_until_ns().
 */
sw_result_t sw_aformat_read(sw_aformat_t *m,
                            uint8_t command,
                            uint8_t asked,
                            uint64_t start_ns,
                            sw_aformat_transmission_t *to_send);

/**
 * Takes frames that were heard one after another, with the last delimiter at `end_ns`: their contents, the
 * first bit of the line in bit 0. `framed` has a byte for each, 0 for a frame whose delimiter reads 0;
 * NULL says that all are framed. At most 48 frames at once. SW_OK once all encoders asked have answered;
 * sw_aformat_missing() says at any time which have not.
 */
sw_result_t sw_aformat_hear(sw_aformat_t *m,
                            const uint16_t *contents,
                            const uint8_t *framed,
                            size_t count,
                            uint64_t end_ns);

/**
 * Sets the time to `now_ns`: ends an exchange whose time has run out, with SW_OK. Hand over received data
 * first.
 */
sw_result_t sw_aformat_poll(sw_aformat_t *m, uint64_t now_ns);

/**
 * While an exchange is pending, the time at which to poll it; afterwards, the time from which the line is
 * free. 0 if nothing was asked, SW_NO_TIME for a state that was not started.
 */
uint64_t sw_aformat_until_ns(const sw_aformat_t *m);

/**
 * The encoders that were asked and have not answered, one bit each; 0xff for a state that was not started
 * or has not asked.
 */
uint8_t sw_aformat_missing(const sw_aformat_t *m);

/**
 * The good response of an encoder to the newest request, as raw fields. SW_E_NO_VALUE if there is none.
 */
sw_result_t sw_aformat_response(const sw_aformat_t *m, uint8_t ea, sw_aformat_response_t *response);

/**
 * The angle of a shaft for commutation, where a turn is 2^32: **false if it must not be used, and the
 * outputs must be switched off.** It is judged now, as by sw_tformat_angle(); the battery is tolerated.
 */
bool sw_aformat_angle(const sw_aformat_t *m,
                      uint8_t ea,
                      uint64_t now_ns,
                      uint64_t max_age_ns,
                      uint32_t *angle);

/**
 * The position with its turns, judged now, nothing tolerated: false if it must not be used.
 */
bool sw_aformat_position(const sw_aformat_t *m,
                         uint8_t ea,
                         uint64_t now_ns,
                         uint64_t max_age_ns,
                         sw_position_t *position);

/**
 * The frames of a request as 16-bit words, the first bit of the line in bit 0 or in bit 15
 * (sw_bit_order_t), at most 4: the port adds start bit and delimiter.
 */
sw_result_t sw_aformat_build(const sw_aformat_request_t *asked,
                             uint8_t order,
                             uint16_t *words,
                             size_t size,
                             size_t *count);

/**
 * The layout with which an encoder answers a request, sw_aformat_layout_t, and its number of frames.
 */
sw_result_t sw_aformat_layout(const sw_aformat_request_t *asked,
                              const sw_aformat_encoder_t *encoder,
                              uint8_t *layout,
                              uint8_t *frames);

/**
 * Reads the response to a request from 16-bit words, one frame each, with all checks.
 */
sw_result_t sw_aformat_parse(const sw_aformat_request_t *asked,
                             const sw_aformat_encoder_t *encoder,
                             const uint16_t *words,
                             size_t count,
                             uint8_t order,
                             sw_aformat_response_t *response);

/**
 * Reads a response of this layout to this command, without its request; `ea` 255 is any.
 */
sw_result_t sw_aformat_parse_as(uint8_t command,
                                uint8_t layout,
                                uint8_t ea,
                                const uint16_t *words,
                                size_t count,
                                uint8_t order,
                                sw_aformat_response_t *response);

/**
 * Does the same from line bits, start bits and delimiters included: `bits` of them in `bytes`. Bits after
 * the 128th are ignored.
 */
sw_result_t sw_aformat_parse_line(uint8_t command,
                                  uint8_t layout,
                                  uint8_t ea,
                                  const uint8_t *bytes,
                                  size_t bits,
                                  uint8_t order,
                                  sw_aformat_response_t *response);

/**
 * Switches a modelled encoder on: position 0, no alarms, with this address.
 */
sw_result_t sw_aformat_device_start(sw_aformat_device_t *device,
                                    uint8_t ea,
                                    const sw_aformat_encoder_t *encoder,
                                    uint32_t bits_per_second);

/**
 * Turns the shaft: counts in the turn before the zero of command 12 is applied, and turns.
 */
sw_result_t sw_aformat_device_set_position(sw_aformat_device_t *device, uint32_t single_turn, uint32_t turns);

/**
 * Sets the causes of these alarms (bits of ALM), and removes those of all others. A latched alarm stays
 * until a reset.
 */
sw_result_t sw_aformat_device_set_alarms(sw_aformat_device_t *device, uint16_t alm);

/**
 * Puts a word into the EEPROM at any address, as the manufacturer does.
 */
sw_result_t sw_aformat_device_set_eeprom(sw_aformat_device_t *device, uint8_t address, uint16_t data);

/**
 * Takes frames that were heard one after another, as sw_aformat_hear() does: its own requests and the
 * answers of others. SW_SEND with `answer` filled, or SW_PENDING.
 */
sw_result_t sw_aformat_device_hear(sw_aformat_device_t *device,
                                   const uint16_t *contents,
                                   const uint8_t *framed,
                                   size_t count,
                                   uint64_t end_ns,
                                   sw_aformat_answer_t *answer);

/**
 * A frame on the line: 18 bits with start bit and delimiter, the first of the line in bit 0.
 */
sw_result_t sw_aformat_build_frame(const sw_aformat_frame_t *it, uint32_t *bits);

/**
 * The word of 32 bits that TI's example shifts out: the frame after idle line.
 */
sw_result_t sw_aformat_build_word32(const sw_aformat_frame_t *it, uint32_t *word);

/**
 * A frame as an encoder hears it: `len` bits of the line, the first in bit 0.
 */
sw_result_t sw_aformat_parse_frame(uint32_t bits, uint32_t len, sw_aformat_frame_t *it);

/**
 * Whether an encoder accepts a request, by its version (sw_aformat_option_t) and all arguments.
 */
sw_result_t sw_aformat_check(const sw_aformat_request_t *asked, const sw_aformat_encoder_t *encoder);

/**
 * The CRC-8 of responses over `count` bits, which are in (count + 7) / 8 bytes.
 */
sw_result_t sw_aformat_crc8(const uint8_t *bytes, size_t count, uint8_t order, uint8_t *crc);

/**
 * The CRC-3 of requests over `count` bits.
 */
sw_result_t sw_aformat_crc3(const uint8_t *bytes, size_t count, uint8_t order, uint8_t *crc);

/**
 * Prepares a receiver of responses of this layout (sw_aformat_layout_t); samples per bit, 1 for a line of
 * bits. `idle` 1: frames of a response may have idle line between them.
 */
sw_result_t sw_aformat_receiver_start(sw_aformat_receiver_t *receiver,
                                      uint8_t layout,
                                      uint32_t samples_per_bit,
                                      bool idle);

/**
 * Takes one sample of the line, 0 or 1. SW_OK with the frames of a response as words, the first bit of the
 * line in bit 15 (SW_MSB_FIRST), at most SW_AFORMAT_FRAMES; SW_PENDING if there is none yet; or why there
 * was none.
 */
sw_result_t sw_aformat_receiver_push(sw_aformat_receiver_t *receiver,
                                     uint8_t level,
                                     uint16_t *words,
                                     size_t size,
                                     size_t *count);

/**
 * Takes one sample of a line on which several encoders answer: as sw_aformat_receiver_push(), with the
 * result of sw_aformat_bus_push() for the response.
 */
sw_result_t sw_aformat_bus_sample(sw_aformat_bus_t *bus,
                                  sw_aformat_receiver_t *receiver,
                                  uint8_t level,
                                  sw_aformat_response_t *response);

/**
 * Ends the line: SW_OK, or why a response that had begun is incomplete.
 */
sw_result_t sw_aformat_bus_line_ends(sw_aformat_bus_t *bus, sw_aformat_receiver_t *receiver);

/**
 * The number of encoders that were asked and have not even begun to answer, or a refusal.
 */
sw_result_t sw_aformat_bus_not_started(const sw_aformat_bus_t *bus);

/**
 * A reset: command 8 (clears the status), 9 (the turns), 10 (both), 11 (gives the only encoder on the line the address `ea`) or 12
 * (**makes this position the zero of the turn and shifts the commutation angle**), eight times, and the status 30 ms later: its ALM is
 * the value. With `careful` 1 the encoder is first made to restart its count, and a failure tells whether
 * the reset was done (SW_E_AFORMAT_NOT_DONE, SW_E_AFORMAT_EFFECT_UNKNOWN); with 0 only the eight requests
 * of the documents are sent. The line and the widths are those of `m`, which must not be used meanwhile.
 * Continue with sw_aformat_next().
 */
sw_result_t sw_aformat_reset(sw_aformat_procedure_t *p,
                             const sw_aformat_t *m,
                             uint8_t command,
                             uint8_t ea,
                             uint8_t careful,
                             uint64_t now_ns);

/**
 * Reads the EEPROM word at `address`; the word is the value. With `careful` 1 the first response is never
 * trusted: it may be left from an interrupted access; use 0 only if you know that there was none.
 */
sw_result_t sw_aformat_eeprom_read(sw_aformat_procedure_t *p,
                                   const sw_aformat_t *m,
                                   uint8_t ea,
                                   uint8_t address,
                                   uint8_t careful,
                                   uint64_t now_ns);

/**
 * Writes an EEPROM word at `address`, 0x00..0xef. With `careful` 1 it is read back and a failure tells whether it was written; with 0
 * the status is read 30 ms later.
 */
sw_result_t sw_aformat_eeprom_write(sw_aformat_procedure_t *p,
                                    const sw_aformat_t *m,
                                    uint8_t ea,
                                    uint8_t address,
                                    uint16_t data,
                                    uint8_t careful,
                                    uint64_t now_ns);

/**
 * Gives the encoder at `ea` an identification code of 24 bits. `careful` as in sw_aformat_eeprom_write().
 */
sw_result_t sw_aformat_write_id(sw_aformat_procedure_t *p,
                                const sw_aformat_t *m,
                                uint8_t ea,
                                uint32_t id,
                                uint8_t careful,
                                uint64_t now_ns);

/**
 * Gives the encoder with this identification code the address `ea`.
 */
sw_result_t sw_aformat_set_address(sw_aformat_procedure_t *p,
                                   const sw_aformat_t *m,
                                   uint32_t id,
                                   uint8_t ea,
                                   uint8_t careful,
                                   uint64_t now_ns);

/**
 * Finds an encoder and its widths: the one at `ea`, or with 255 the only one on the line. The value is its type word.
 */
sw_result_t sw_aformat_detect(sw_aformat_procedure_t *p,
                              const sw_aformat_t *m,
                              uint8_t ea,
                              uint64_t now_ns);

/**
 * Returns what a procedure needs next: SW_SEND with `to_send` filled (hear and poll by
 * sw_aformat_procedure_hear() and sw_aformat_procedure_poll() until the exchange ends, then call this
 * again), SW_PENDING while the exchange runs, SW_OK when the procedure is done, or why it failed.
 */
sw_result_t sw_aformat_next(sw_aformat_procedure_t *p, uint64_t now_ns, sw_aformat_transmission_t *to_send);

/**
 * Takes frames that were heard one after another, as sw_aformat_hear() does. SW_PENDING, or the exchange
 * has ended: SW_OK or its refusal.
 */
sw_result_t sw_aformat_procedure_hear(sw_aformat_procedure_t *p,
                                      const uint16_t *contents,
                                      const uint8_t *framed,
                                      size_t count,
                                      uint64_t end_ns);

/**
 * Sets the time to `now_ns`: ends an exchange whose time has run out. Hand over received data first.
 */
sw_result_t sw_aformat_procedure_poll(sw_aformat_procedure_t *p, uint64_t now_ns);

/**
 * While an exchange of a procedure is pending, the time at which to poll it; afterwards, the time from
 * which the line is free. SW_NO_TIME for a state that was not started.
 */
uint64_t sw_aformat_procedure_until_ns(const sw_aformat_procedure_t *p);

/**
 * Returns the result of a procedure that has ended with SW_OK: the EEPROM word, the type word, ALM after a
 * reset, else 0. `ready_ns` (may be NULL) is the time from which the encoder accepts requests again; it is
 * also set after a failure, with the failure as the result.
 */
sw_result_t sw_aformat_value(const sw_aformat_procedure_t *p, uint32_t *value, uint64_t *ready_ns);

/**
 * After sw_aformat_detect() has ended with SW_OK: the address and the widths of the encoder. SW_E_NO_VALUE
 * before that, and for an unknown type word.
 */
sw_result_t sw_aformat_detected(const sw_aformat_procedure_t *p,
                                uint8_t *ea,
                                uint8_t *st_bits,
                                uint8_t *mt_bits);

/**
 * ES as an encoder with these alarms shows it.
 */
uint8_t sw_aformat_es_of_alarms(uint16_t alm);

/**
 * The alarms that a version has: `version_3` false for 2.1, true for 3.0.
 */
uint16_t sw_aformat_known_alarms(bool version_3);

/**
 * A temperature, 10 bits, in 0.001 °C, as the specification counts it.
 */
sw_result_t sw_aformat_milli_celsius(uint16_t raw, uint32_t *milli_celsius);

/**
 * The same if the bits are in two's complement, which no document states.
 */
sw_result_t sw_aformat_signed_milli_celsius(uint16_t raw, int32_t *milli_celsius);

/**
 * A type word.
 */
sw_result_t sw_aformat_parse_type(uint16_t word, sw_aformat_type_t *it);

/**
 * The angle of a single-turn position, 0.001 degrees, rounded down.
 */
sw_result_t sw_aformat_milli_degrees(const sw_aformat_encoder_t *encoder,
                                     uint32_t single_turn,
                                     uint32_t *milli_degrees);

/**
 * The 40 bits of a position, of turn and turns.
 */
sw_result_t sw_aformat_compose(const sw_aformat_encoder_t *encoder,
                               uint32_t single_turn,
                               uint32_t turns,
                               uint64_t *abs);

/**
 * The 40 bits of a position from its halves of 24 bits, which overlap by eight (ABS24 and ABS24H).
 * SW_E_NO_VALUE if the overlapping bits differ.
 */
sw_result_t sw_aformat_join(uint32_t low24, uint32_t high24, uint64_t *abs);

/**
 * How long responses of a layout (sw_aformat_layout_t) take at a rate of the specification, in bit/s, when 1..8 encoders are asked.
 */
sw_result_t sw_aformat_times(uint32_t bits_per_second,
                             uint8_t layout,
                             uint8_t encoders,
                             sw_aformat_times_t *times);

/**
 * Reads the response of layout ABS40 to command 0 or 4 from its four frames, one 16-bit word each, with
 * all checks; `ea` 255 is any.
 */
sw_result_t sw_aformat_parse_abs40(uint8_t command,
                                   uint8_t ea,
                                   const uint16_t *words,
                                   size_t count,
                                   uint8_t order,
                                   sw_aformat_abs40_t *data);

/**
 * Begins, with the request sent, the widths of the encoders, and the addresses asked: a bit each in
 * `asked` (bit 0 is EA 0).
 */
sw_result_t sw_aformat_bus_start(sw_aformat_bus_t *bus,
                                 const sw_aformat_request_t *asked,
                                 const sw_aformat_encoder_t *encoder,
                                 uint8_t addresses);

/**
 * Does the same for the whole position of all encoders asked: command 4 to the highest address, for
 * sw_aformat_bus_push_abs40().
 */
sw_result_t sw_aformat_bus_start_abs40(sw_aformat_bus_t *bus, uint8_t addresses);

/**
 * Takes one response of four frames, one 16-bit word each. The results are those of sw_aformat_bus_push(),
 * for less flash: it knows only positions. SW_E_ARGUMENT for a bus that was started for another
 * layout.
 */
sw_result_t sw_aformat_bus_push_abs40(sw_aformat_bus_t *bus,
                                      const uint16_t *words,
                                      size_t count,
                                      uint8_t order,
                                      sw_aformat_abs40_t *data);

/**
 * Takes one response, a 16-bit word for each frame. SW_OK with the response, or why it is refused. A second
 * good one from the same address is SW_E_AFORMAT_TWO_RESPONSES: two encoders have it; one from an address that was not asked is
 * SW_E_AFORMAT_ADDRESS_MISMATCH. Both are filled in for inspection.
 */
sw_result_t sw_aformat_bus_push(sw_aformat_bus_t *bus,
                                const uint16_t *words,
                                size_t count,
                                uint8_t order,
                                sw_aformat_response_t *response);

/**
 * The encoders that were asked and have not given a good response, one bit each; 0xff for a state that was
 * not started.
 */
uint8_t sw_aformat_bus_missing(const sw_aformat_bus_t *bus);

/**
 * Sets the rate of the timer, once: at least 1 MHz (a coarser timer cannot tell one field from the next:
 * SW_E_ARGUMENT). The time is 0 ns now, when the timer reads `ticks`.
 */
sw_result_t sw_clock_start(sw_clock_t *clock, uint32_t timer_hz, uint32_t ticks);

/**
 * Returns the time in ns since the start, from a reading of the timer. It never goes back and wraps after
 * 584 years.
 *
 * The timer has to be read within half of its range, 12.6 s at 170 MHz. A timer that went back or was not read for too long gives
 * SW_NO_TIME, once, which all other functions refuse; after that, time continues from where it was.
 * If several priorities do this, read the timer and make this call within one critical section.
 */
uint64_t sw_clock_ns(sw_clock_t *clock,
                     uint32_t ticks);

/**
 * Reads an answer by the rules of a dialect (sw_hdsl_dialect_t): `len` bits of the line, the first in bit
 * 0. Its channels are judged one by one; only bits that are no answer at all are refused,
 * SW_E_HDSL_TRUNCATED.
 */
sw_result_t sw_hdsl_parse_answer(uint64_t bits, uint32_t len, uint8_t dialect, sw_hdsl_answer_t *answer);

/**
 * The bits of an answer, the first of the line in bit 0, at a running disparity, -1 or 1, which becomes
 * the one after it.
 */
sw_result_t sw_hdsl_build_answer(const sw_hdsl_content_t *content, int8_t *rd, uint64_t *bits);

/**
 * The safe positions in the eight answers of a V-frame.
 */
sw_result_t sw_hdsl_parse_v_frame(const uint64_t *bits,
                                  size_t len,
                                  uint8_t dialect,
                                  sw_hdsl_v_frame_t *v_frame);

/**
 * Switches a modelled encoder on, with an encoder identifier.
 */
sw_result_t sw_hdsl_device_start(sw_hdsl_device_t *device, uint32_t encoder_id);

/**
 * Turns its shaft.
 */
sw_result_t sw_hdsl_device_set_position(sw_hdsl_device_t *device, uint64_t position);

/**
 * Returns its answer to the head of an H-frame: the 61 bits for sw_hdsl_hear_bits(), all ones if it is
 * silent.
 */
sw_result_t sw_hdsl_device_hear(sw_hdsl_device_t *device,
                                const sw_hdsl_transmission_t *heard,
                                uint64_t *bits);

/**
 * Creates a tracker for an encoder with this many position bits, 8..40, by the rules of a dialect
 * (sw_hdsl_dialect_t).
 */
sw_result_t sw_hdsl_tracker_start(sw_hdsl_tracker_t *tracker, uint8_t position_bits, uint8_t dialect);

/**
 * Takes an H-frame with this change of speed, -1024..1023 steps.
 */
sw_result_t sw_hdsl_tracker_step(sw_hdsl_tracker_t *tracker, int16_t delta_delta);

/**
 * Takes an H-frame whose acceleration must not be used.
 */
sw_result_t sw_hdsl_tracker_miss(sw_hdsl_tracker_t *tracker);

/**
 * Takes the safe position at the end of a V-frame.
 */
sw_result_t sw_hdsl_tracker_align(sw_hdsl_tracker_t *tracker, uint64_t vpos);

/**
 * Takes a V-frame without a safe position.
 */
sw_result_t sw_hdsl_tracker_no_safe_position(sw_hdsl_tracker_t *tracker);

/**
 * The registers.
 */
sw_result_t sw_hdsl_tracker_registers(const sw_hdsl_tracker_t *tracker,
                                      sw_hdsl_position_registers_t *registers);

/**
 * Creates a monitor at its initial value, 8, with the penalties of a dialect (sw_hdsl_dialect_t).
 */
sw_result_t sw_hdsl_quality_start(sw_hdsl_quality_t *quality, uint8_t dialect);

/**
 * Counts an event, sw_hdsl_quality_event_t.
 */
sw_result_t sw_hdsl_quality_count(sw_hdsl_quality_t *quality, uint8_t event);

/**
 * The value of the monitor, 0..15, or a refusal.
 */
sw_result_t sw_hdsl_quality_value(const sw_hdsl_quality_t *quality);

/**
 * Whether the link is lost; true for a state that was not started.
 */
bool sw_hdsl_quality_is_lost(const sw_hdsl_quality_t *quality);

/**
 * A head with a parameter byte, after a line of this disparity. `edge` is where the sampling edge stands in the EXTRA window, in eighths of
 * a bit, 24..72; 0 for a free-running frame.
 */
sw_result_t sw_hdsl_build_head(uint8_t parameter,
                               uint8_t edge,
                               int8_t before,
                               sw_hdsl_head_t *head);

/**
 * The same as samples, eight a bit, a byte each: SW_E_SHORT_BUFFER below `head.len` bytes.
 */
sw_result_t sw_hdsl_head_samples(uint8_t parameter,
                                 uint8_t edge,
                                 int8_t before,
                                 uint8_t *samples,
                                 size_t size,
                                 size_t *len);

/**
 * The parameter byte in a head as an encoder hears it, and the bits of its EXTRA window beyond a free-running one.
 */
sw_result_t sw_hdsl_parse_head(const sw_hdsl_head_t *head,
                               uint8_t *parameter,
                               uint8_t *extra_bits);

/**
 * The bits that level a line of this disparity, which becomes the one after them.
 */
sw_result_t sw_hdsl_equalisation(int8_t *disparity, uint8_t *bits);

/**
 * The word of a parameter byte on a line of this disparity, which becomes the one after it.
 */
sw_result_t sw_hdsl_build_parameter(uint8_t parameter, int8_t *disparity, uint16_t *word);

/**
 * The parameter byte of a word. SW_E_NO_VALUE if the word is not a parameter word.
 */
sw_result_t sw_hdsl_parse_parameter(uint16_t word, uint8_t *parameter);

/**
 * The window and the stuffing of the next frame, whose edge comes `adjust` eighths later than without. `edge_register` is only written.
 * SW_E_HDSL_EXTRA_OUT_OF_RANGE: it cannot, and stays as it was.
 */
sw_result_t sw_hdsl_extra_step(sw_hdsl_extra_t *state,
                               int16_t adjust);

/**
 * EXTRA_EDGE for a sampling edge at 24..72 eighths of a bit: the samples of the last bit. 0 for another edge.
 */
uint8_t sw_hdsl_edge_register(uint8_t edge);

/**
 * The bytes of a short message with their CRC.
 */
sw_result_t sw_hdsl_build_short(const sw_hdsl_short_t *it, uint8_t *bytes, size_t size, size_t *len);

/**
 * A short message as an encoder receives it.
 */
sw_result_t sw_hdsl_parse_short(const uint8_t *bytes, size_t len, sw_hdsl_short_t *it);

/**
 * What the encoder answers to a short message, with the value that was read.
 */
sw_result_t sw_hdsl_build_short_answer(const sw_hdsl_short_t *it,
                                       uint8_t value,
                                       uint8_t *bytes,
                                       size_t size,
                                       size_t *len);

/**
 * The answer to a short message: the value that was read, 0 after a write.
 */
sw_result_t sw_hdsl_parse_short_answer(const sw_hdsl_short_t *it,
                                       const uint8_t *bytes,
                                       size_t len,
                                       uint8_t *value);

/**
 * The bytes of a long message with their CRC.
 */
sw_result_t sw_hdsl_build_long(const sw_hdsl_long_t *it, uint8_t *bytes, size_t size, size_t *len);

/**
 * A long message as an encoder receives it.
 */
sw_result_t sw_hdsl_parse_long(const uint8_t *bytes, size_t len, sw_hdsl_long_t *it);

/**
 * What the encoder answers to a long message: data, or (`refuses` is 1) its error code, detail and class.
 */
sw_result_t sw_hdsl_build_long_answer(const sw_hdsl_long_t *it,
                                      uint8_t refuses,
                                      const sw_hdsl_data_t *answer,
                                      uint8_t *bytes,
                                      size_t size,
                                      size_t *len);

/**
 * The answer to a long message. Of SW_E_HDSL_RESOURCE the code of the encoder is written too.
 */
sw_result_t sw_hdsl_parse_long_answer(const sw_hdsl_long_t *it,
                                      const uint8_t *bytes,
                                      size_t len,
                                      sw_hdsl_data_t *answer);

/**
 * Starts a short message on a running link; sw_hdsl_finished() reports its end. SW_E_HDSL_BUSY,
 * SW_E_HDSL_NOT_LOCKED. A failed message may be sent again up to the limit of tries.
 */
sw_result_t sw_hdsl_send_short(sw_hdsl_t *m, const sw_hdsl_short_t *it);

/**
 * Starts a long message on a running link, which is sent once.
 */
sw_result_t sw_hdsl_send_long(sw_hdsl_t *m, const sw_hdsl_long_t *it);

/**
 * Drops all messages, and tells the encoder so (MRST).
 */
sw_result_t sw_hdsl_reset_messages(sw_hdsl_t *m);

/**
 * Returns which messages ended in the last H-frame heard.
 */
sw_result_t sw_hdsl_finished(const sw_hdsl_t *m, sw_hdsl_finished_t *finished);

/**
 * Prepares a free-running receiver, which begins with the start-up. `steps_per_turn` is the encoder's resolution, for angles; 0 if it is not
 * known. `dialect` is sw_hdsl_dialect_t.
 */
sw_result_t sw_hdsl_start(sw_hdsl_t *m,
                          uint8_t dialect,
                          uint32_t steps_per_turn);

/**
 * Returns the data to send in the present H-frame.
 */
sw_result_t sw_hdsl_transmission(const sw_hdsl_t *m, sw_hdsl_transmission_t *to_send);

/**
 * Ends the H-frame: takes the samples of its window (SW_HDSL_WINDOW bytes if an encoder answers), which
 * ended at `end_ns`. The result is the state of the receiver, sw_hdsl_state_t.
 */
sw_result_t sw_hdsl_hear(sw_hdsl_t *m, const uint8_t *samples, size_t len, uint64_t end_ns);

/**
 * The same from a receiver that gives bits: the 61 of the answer, the first of the line in bit 0; all ones without an answer.
 */
sw_result_t sw_hdsl_hear_bits(sw_hdsl_t *m,
                              uint64_t bits,
                              uint64_t end_ns);

/**
 * The fast position, judged now: **false if it must not be used, and the outputs must be switched off**:
 * never heard, no link, estimated, not aligned with the safe one, too fast, older than `max_age_ns`.
 */
bool sw_hdsl_position(const sw_hdsl_t *m, uint64_t now_ns, uint64_t max_age_ns, sw_hdsl_position_t *position);

/**
 * The safe position of the last V-frame, judged now: false if it must not be used.
 */
bool sw_hdsl_safe_position(const sw_hdsl_t *m, uint64_t now_ns, uint64_t max_age_ns, int64_t *position);

/**
 * The last H-frame heard: what has to be driven after its answer, and what it brought.
 */
sw_result_t sw_hdsl_frame(const sw_hdsl_t *m, sw_hdsl_frame_t *frame);

/**
 * Where the receiver is in its start-up: sw_hdsl_state_t, or a refusal.
 */
sw_result_t sw_hdsl_state(const sw_hdsl_t *m);

/**
 * The encoder identifier, 20 bits. SW_E_NO_VALUE before it has come.
 */
sw_result_t sw_hdsl_encoder_id(const sw_hdsl_t *m, uint32_t *id);

/**
 * Restarts the link at the end of the present frame (PRST).
 */
sw_result_t sw_hdsl_restart(sw_hdsl_t *m);

/**
 * Reports that this many H-frames, whose answers will not be heard, were on the line before the next one
 * heard.
 */
sw_result_t sw_hdsl_skip(sw_hdsl_t *m, uint8_t frames);

/**
 * Prepares a receiver that keeps its frames on an external pulse: `period` eighths of a bit (13.333 ns
 * each) from pulse to pulse, and 1..10 frames for each. Otherwise as sw_hdsl_start();
 * SW_E_HDSL_PERIOD_TOO_SHORT, SW_E_HDSL_EXTRA_OUT_OF_RANGE.
 */
sw_result_t sw_hdsl_start_synchronised(sw_hdsl_t *m,
                                       uint8_t dialect,
                                       uint32_t steps_per_turn,
                                       uint32_t period,
                                       uint8_t frames_per_pulse);

/**
 * The frames of a running link are synchronised from the next one on, or free running with 0 frames. The link goes on.
 */
sw_result_t sw_hdsl_set_sync(sw_hdsl_t *m,
                             uint32_t period,
                             uint8_t frames_per_pulse);

/**
 * Whether the edge of the present frame belongs to a pulse.
 */
bool sw_hdsl_is_on_pulse(const sw_hdsl_t *m);

/**
 * Whether the last pulses came close to their edges.
 */
bool sw_hdsl_is_in_step(const sw_hdsl_t *m);

/**
 * Reports that the pulse of the present frame came this many eighths of a bit after its sampling edge
 * (below 0: before it). Call it before the answer is heard, in frames that are on a pulse.
 */
sw_result_t sw_hdsl_hear_pulse(sw_hdsl_t *m, int16_t late);

/**
 * The registers of a receiver of this dialect (sw_hdsl_dialect_t) before its first frame.
 */
sw_result_t sw_hdsl_registers_start(sw_hdsl_registers_t *map, uint8_t dialect);

/**
 * Takes over what the receiver heard last: call it once after each sw_hdsl_hear().
 */
sw_result_t sw_hdsl_registers_apply(sw_hdsl_registers_t *map, const sw_hdsl_t *m);

/**
 * Reads a register as an application does: reading PIPE_S takes an entry. SW_E_HDSL_NO_REGISTER.
 */
sw_result_t sw_hdsl_registers_read(sw_hdsl_registers_t *map, uint8_t address, uint8_t *value);

/**
 * Reads a register without taking an entry.
 */
sw_result_t sw_hdsl_registers_look(const sw_hdsl_registers_t *map, uint8_t address, uint8_t *value);

/**
 * Writes a register as an application does, which starts what it stands for in the receiver: messages,
 * resets, synchronisation. A refused write leaves the value unchanged.
 */
sw_result_t sw_hdsl_registers_write(sw_hdsl_registers_t *map, sw_hdsl_t *m, uint8_t address, uint8_t value);

/**
 * How far the fast position is aligned with the safe one: sw_hdsl_stage_t, or a refusal.
 */
sw_result_t sw_hdsl_registers_stage(const sw_hdsl_registers_t *map);

/**
 * An empty FIFO.
 */
sw_result_t sw_hdsl_pipe_start(sw_hdsl_pipe_t *pipe);

/**
 * A word of the pipe channel by the rules of a dialect (sw_hdsl_dialect_t): the oldest one goes if there is no room.
 */
sw_result_t sw_hdsl_pipe_put(sw_hdsl_pipe_t *pipe,
                             uint16_t word,
                             uint8_t dialect);

/**
 * Takes the oldest entry: PIPE_S and PIPE_D.
 */
sw_result_t sw_hdsl_pipe_take(sw_hdsl_pipe_t *pipe, uint8_t *status, uint8_t *data);

/**
 * Finds the test pattern of the start-up in a window of samples, by the edges that a dialect looks at. SW_E_HDSL_NO_EDGE, or
 * SW_E_HDSL_PATTERN_NOT_FOUND, which writes `index` as the first edge gave it.
 */
sw_result_t sw_hdsl_learn(const uint8_t *samples,
                          size_t len,
                          uint8_t dialect,
                          sw_hdsl_alignment_t *alignment);

/**
 * The 61 bits of an answer in its window of samples, the first of the line in bit 0, and their RSSI, 0..12 (may be NULL).
 */
sw_result_t sw_hdsl_sampled(const sw_hdsl_alignment_t *alignment,
                            const uint8_t *samples,
                            size_t len,
                            uint64_t *bits,
                            uint8_t *rssi);

/**
 * The sample, 0..7, that lies in the middle of the bits of a line with a falling (or a rising) edge in these eight samples.
 */
uint8_t sw_hdsl_sample_index(uint8_t samples,
                             bool falling);

/**
 * Bit n is set if the line changes before sample n of these eight; `previous` is the sample before them.
 */
uint8_t sw_hdsl_edges(bool previous, uint8_t samples);

/**
 * RSSI of the places in a bit at which edges were seen, 0..12.
 */
uint8_t sw_hdsl_rssi(uint8_t edges);

/**
 * The longest part of a bit without edges, 1..8 samples; 0 if no edge was seen.
 */
uint8_t sw_hdsl_longest_gap(uint8_t edges);

/**
 * The word of a character at a running disparity, -1 or 1, which becomes that after it. The first bit of the line is bit 0.
 */
sw_result_t sw_hdsl_build_word(const sw_hdsl_character_t *it,
                               int8_t *rd,
                               uint16_t *out);

/**
 * How a dialect (sw_hdsl_dialect_t) reads a word.
 */
sw_result_t sw_hdsl_read_word(uint16_t raw, uint8_t dialect, sw_hdsl_reading_t *reading);

/**
 * Ones minus zeros of the ten bits of a word.
 */
int8_t sw_hdsl_disparity(uint16_t raw);

/**
 * Whether a word stands in the column of the running disparity `rd` (sw_hdsl_disparity_t), which becomes that after it.
 */
sw_result_t sw_hdsl_check_disparity(uint16_t raw,
                                    int8_t *rd);

/**
 * The CRC-16 of safe positions and messages; its high byte is sent first.
 */
sw_result_t sw_hdsl_crc16(const uint8_t *bytes, size_t len, uint16_t *crc);

/**
 * The change of speed in an acceleration word, -1024..1023 steps. SW_E_HDSL_ACCELERATION_CRC.
 */
sw_result_t sw_hdsl_parse_acceleration(uint16_t raw, int16_t *delta_delta);

/**
 * The acceleration word of a change of speed, -1024..1023 steps, with its CRC-5.
 */
sw_result_t sw_hdsl_build_acceleration(int16_t delta_delta, uint16_t *out);

/**
 * Prepares an axis at rest at position 0: its two ends, and the `static` queue between them. Neither end may
 * be in use during this call.
 */
sw_result_t sw_motion_start(sw_motion_axis_t *axis,
                            sw_motion_timer_t *timer,
                            sw_motion_queue_t *queue,
                            const sw_motion_setup_t *setup);

/**
 * Returns the event that is due now. Call it in the interrupt of the timer, and once when sw_motion_poll()
 * returns SW_MOTION_START.
 */
sw_result_t sw_motion_fire(sw_motion_timer_t *timer, sw_motion_fired_t *fired);

/**
 * Does a slice of planning, in the background. Returns sw_motion_work_t, or a refusal. Call it until it returns anything but
 * SW_MOTION_MORE, again after each request, and every half of the reach: less often, the axis comes to rest again and again. Each
 * step of the stop that it makes then is within a sixteenth of an interval.
 */
sw_result_t sw_motion_poll(sw_motion_axis_t *axis);

/**
 * Moves to a position, in steps.
 */
sw_result_t sw_motion_move_to(sw_motion_axis_t *axis, int64_t target);

/**
 * Runs at this speed, in steps/s, until something else is asked for; `reverse` is 0 or 1.
 */
sw_result_t sw_motion_run(sw_motion_axis_t *axis, uint8_t reverse, uint32_t speed);

/**
 * Slows down to rest within the limits; the target is dropped.
 */
sw_result_t sw_motion_stop(sw_motion_axis_t *axis);

/**
 * Slows down to rest within other limits, higher ones for a limit switch; the target is dropped. Moves are
 * refused until it is at rest. A quick stop is never longer than sw_motion_stop(), even one under way.
 */
sw_result_t sw_motion_quick_stop(sw_motion_axis_t *axis, const sw_motion_limits_t *limit);

/**
 * Stops at once: no further step is made.
 */
sw_result_t sw_motion_halt(sw_motion_axis_t *axis);

/**
 * Slows down to rest within the limits; sw_motion_resume() continues the motion.
 */
sw_result_t sw_motion_hold(sw_motion_axis_t *axis);

/**
 * Continues the motion after sw_motion_hold().
 */
sw_result_t sw_motion_resume(sw_motion_axis_t *axis);

/**
 * Sets the feed override, in percent of the speed; more than 100 counts as 100, and 0 holds.
 */
sw_result_t sw_motion_set_override(sw_motion_axis_t *axis, uint16_t percent);

/**
 * Sets other limits, at rest.
 */
sw_result_t sw_motion_set_limits(sw_motion_axis_t *axis, const sw_motion_limits_t *limit);

/**
 * Says, at rest, which position this is, in steps: 0 at a reference. The target is forgotten, on hold too.
 */
sw_result_t sw_motion_set_commanded(sw_motion_axis_t *axis, int64_t position);

/**
 * Tells the commanded position of the axis, in steps.
 */
sw_result_t sw_motion_commanded(const sw_motion_axis_t *axis, int64_t *position);

/**
 * Returns whether the axis is at rest; false for a state that was not started.
 */
bool sw_motion_is_at_rest(const sw_motion_axis_t *axis);

/**
 * Returns whether the last stop was sw_motion_halt(): the steps are counted, but the motor may have run on.
 * False for a state that was not started.
 */
bool sw_motion_is_halted(const sw_motion_axis_t *axis);

/**
 * Starts the homing of an axis at rest: fast towards its switch, back, and slowly towards it again. `closed`
 * is the level of the switch, 1 for an axis at the switch or beyond it; such an axis moves off it first.
 */
sw_result_t sw_motion_home(sw_motion_homing_t *homing,
                           sw_motion_axis_t *axis,
                           const sw_motion_homing_setup_t *setup,
                           uint8_t closed);

/**
 * Looks at the switch, and asks the axis for what comes next. Call it often, at least once a step of the
 * approach, beside sw_motion_poll(). A hold and an override act on a homing as on any motion; a move, a stop
 * or a halt ends it. Returns sw_motion_homing_state_t, or a refusal.
 */
sw_result_t sw_motion_homing_poll(sw_motion_homing_t *homing, sw_motion_axis_t *axis, uint8_t closed);

/**
 * Prepares a receiver: samples per bit, and data bits per field (8 for a UART).
 */
sw_result_t sw_nrz_start(sw_nrz_t *receiver, uint32_t samples_per_bit, uint32_t content_bits);

/**
 * Takes `samples` samples of one level (0 or 1) at once; a run ends at most one field. SW_OK with a field,
 * SW_PENDING without.
 */
sw_result_t sw_nrz_run(sw_nrz_t *receiver, uint8_t level, uint64_t samples, sw_nrz_field_t *field);

/**
 * Returns the name of a result in `snake_case`, as the logs and test vectors of servowire spell it; "unknown" for a number that is
 * not a result. It is never NULL and stays valid.
 */
const char *sw_text(sw_result_t result);

/**
 * Prepares an axis whose drive has not answered yet.
 */
sw_result_t sw_rtex_axis_start(sw_rtex_axis_t *axis, const sw_rtex_config_t *config);

/**
 * Takes the result of an update period: the block of this axis, or NULL if there was none, heard until
 * `end_ns`. A block of another length is a refused one.
 */
sw_result_t sw_rtex_axis_hear(sw_rtex_axis_t *axis, const uint8_t *bytes, size_t len, uint64_t end_ns);

/**
 * Writes the block of the next update period, 16 bytes, which counts as sent.
 */
sw_result_t sw_rtex_axis_transmit(sw_rtex_axis_t *axis, uint8_t *bytes, size_t size);

/**
 * Takes back that the last block counts as sent, because it could not be written to the ASIC: the drive still has the one
 * before, from which the next step, a stop and switching on go on. Once for each such block, before the next one.
 */
sw_result_t sw_rtex_axis_not_sent(sw_rtex_axis_t *axis);

/**
 * Switches the servo on: SW_E_RTEX_NOT_NOW if the axis is not off, no new position has come, or the drive is not ready.
 */
sw_result_t sw_rtex_axis_switch_on(sw_rtex_axis_t *axis);

/**
 * Switches the servo off.
 */
sw_result_t sw_rtex_axis_switch_off(sw_rtex_axis_t *axis);

/**
 * Stops by category 0 (servo off at once), 1 (slow down, then off) or 2 (slow down and hold), as far as the limits of the axis allow.
 */
sw_result_t sw_rtex_axis_stop(sw_rtex_axis_t *axis,
                              uint8_t category);

/**
 * Leaves the stop: the axis may be switched on again when its drive allows.
 */
sw_result_t sw_rtex_axis_clear(sw_rtex_axis_t *axis);

/**
 * Sets the target of CP in command units. SW_E_RTEX_TOO_FAR if the step from the last one is more than the
 * drive's gear and the limits allow, SW_E_RTEX_NOT_NOW if the axis is not on or in another mode; the
 * set-point then stays.
 */
sw_result_t sw_rtex_axis_set_position(sw_rtex_axis_t *axis, int32_t position);

/**
 * Sets the speed of CV or the torque of CT, in the units of the drive.
 */
sw_result_t sw_rtex_axis_set_rate(sw_rtex_axis_t *axis, int32_t rate);

/**
 * Sets the control bits other than Servo_On and the stops (sw_rtex_control_t, added), from the next block
 * onwards.
 */
sw_result_t sw_rtex_axis_set_control(sw_rtex_axis_t *axis, uint16_t control);

/**
 * The set-point: in CP the target in command units; 0 for a state that was not started.
 */
int32_t sw_rtex_axis_setpoint(const sw_rtex_axis_t *axis);

/**
 * The state of the axis, and the reason.
 */
sw_result_t sw_rtex_axis_state(const sw_rtex_axis_t *axis, sw_rtex_state_of_t *state);

/**
 * The actual position, judged now: **false if it must not be used**: never heard, older than `max_age_ns`, an alarm of the drive.
 */
bool sw_rtex_feedback(const sw_rtex_axis_t *axis,
                      uint64_t now_ns,
                      uint64_t max_age_ns,
                      sw_rtex_feedback_t *feedback);

/**
 * The response in a block of 16 bytes.
 */
sw_result_t sw_rtex_parse_response(const uint8_t *bytes, size_t len, sw_rtex_response_t *response);

/**
 * The command in a block of 16 bytes, as a drive receives it.
 */
sw_result_t sw_rtex_parse_command(const uint8_t *bytes, size_t len, sw_rtex_command_t *command);

/**
 * The block of a command, 16 bytes. Reserved bits are sent as 0.
 */
sw_result_t sw_rtex_build_command(const sw_rtex_command_t *it, uint8_t *bytes, size_t size);

/**
 * The command in a block of 16 bytes whose reserved bits have to be 0: SW_E_RTEX_RESERVED, SW_E_RTEX_CODE_PAIR.
 */
sw_result_t sw_rtex_parse_command_strict(const uint8_t *bytes,
                                         size_t len,
                                         sw_rtex_command_t *command);

/**
 * The command in a block of 32 bytes.
 */
sw_result_t sw_rtex_parse_command32(const uint8_t *bytes,
                                    size_t len,
                                    sw_rtex_command_t *command,
                                    sw_rtex_sub_command_t *sub);

/**
 * The block of a command of the 32-byte mode.
 */
sw_result_t sw_rtex_build_command32(const sw_rtex_command_t *it,
                                    const sw_rtex_sub_command_t *sub,
                                    uint8_t *bytes,
                                    size_t size);

/**
 * The response in a block of 32 bytes.
 */
sw_result_t sw_rtex_parse_response32(const uint8_t *bytes,
                                     size_t len,
                                     sw_rtex_response_t *response,
                                     sw_rtex_sub_response_t *sub);

/**
 * The block of a response, 16 bytes, as a drive sends it.
 */
sw_result_t sw_rtex_build_response(const sw_rtex_response_t *it, uint8_t *bytes, size_t size);

/**
 * The block of a response of the 32-byte mode, as a drive sends it.
 */
sw_result_t sw_rtex_build_response32(const sw_rtex_response_t *it,
                                     const sw_rtex_sub_response_t *sub,
                                     uint8_t *bytes,
                                     size_t size);

/**
 * The control bits that a drive knows, of bytes 2 and 3 (byte 2 is the low one); the others are reserved.
 */
uint16_t sw_rtex_known_control(uint16_t control);

/**
 * Prepares a control in PH_INIT.
 */
sw_result_t sw_rtex_phases_start(sw_rtex_phases_t *phases);

/**
 * Makes a step of the control; returns the new phase (sw_rtex_phase_t), or a refusal.
 */
sw_result_t sw_rtex_phases_step(sw_rtex_phases_t *phases, const sw_rtex_inputs_t *inputs);

/**
 * Why the control has stopped: sw_rtex_fault_t, or a refusal.
 */
sw_result_t sw_rtex_phases_fault(const sw_rtex_phases_t *phases);

/**
 * Returns what the LED shows `t_ms` after the beginning of a lit half period: sw_rtex_led_t, or a refusal.
 */
sw_result_t sw_rtex_led(uint8_t phase, uint8_t fault, uint64_t t_ms);

/**
 * The periods for Pr7.20, Pr7.21 and Pr7.91 (ns; below 0: not told) of an A6N drive. SW_E_NO_VALUE for a combination that is not listed.
 */
sw_result_t sw_rtex_periods_a6n(int32_t pr7_20,
                                int32_t pr7_21,
                                int64_t pr7_91,
                                sw_rtex_periods_t *periods);

/**
 * Returns how long a frame for this number of axes takes, in ns (System Design Guide for Master).
 */
uint64_t sw_rtex_frame_ns(uint32_t axes);

/**
 * How many axes a communication period has room for, by the time on the line.
 */
uint32_t sw_rtex_axes_within(uint32_t com_ns);

/**
 * The reload value of a timer for a period. SW_E_NO_VALUE if it is not a whole number of ticks.
 */
sw_result_t sw_rtex_timer_reload(uint32_t timer_hz, uint32_t period_ns, uint32_t *reload);

/**
 * The step from one position to the next, through the end of 32 bits too.
 */
int32_t sw_rtex_step(int32_t before, int32_t after);

/**
 * Whether a step in an update period is within 400 million pulses per second after the electronic gear: 1
 * or 0, or a refusal.
 */
sw_result_t sw_rtex_is_within_limit(int32_t step,
                                    uint32_t update_ns,
                                    uint32_t gear_numerator,
                                    uint32_t gear_denominator);

/**
 * The 12-bit type code of the older drives for one of monitor (sw_rtex_noncyclic_t 10) or system ID (2). SW_E_NO_VALUE if there is none.
 */
sw_result_t sw_rtex_conventional(uint8_t noncyclic,
                                 uint16_t code);

/**
 * The index of parameter Pr `class`.`number` in a parameter command.
 */
uint16_t sw_rtex_parameter_index(uint8_t class_, uint8_t number);

/**
 * Switches a drive on: update period 0.5 ms, one communication per update, gear 1/1.
 */
sw_result_t sw_rtex_drive_start(sw_rtex_drive_t *drive, uint8_t mac_id);

/**
 * Makes an exchange: takes a command of 16 or 32 bytes, and returns a response of the same length.
 * SW_E_NO_VALUE if the drive is silent.
 */
sw_result_t sw_rtex_drive_hear(sw_rtex_drive_t *drive,
                               const uint8_t *bytes,
                               size_t len,
                               uint8_t *response,
                               size_t size);

/**
 * The position of its motor, in command units.
 */
sw_result_t sw_rtex_drive_position(const sw_rtex_drive_t *drive, int32_t *position);

/**
 * Packs a block into words for an ASIC on a 16-bit bus: the byte that is sent first is in the low bits, on every host. SW_E_ARGUMENT
 * unless `count` words hold exactly `len` bytes.
 */
sw_result_t sw_rtex_to_words16(const uint8_t *bytes,
                               size_t len,
                               uint16_t *words,
                               size_t count);

/**
 * Packs a block into words for an ASIC on a 32-bit bus, as sw_rtex_to_words16().
 */
sw_result_t sw_rtex_to_words32(const uint8_t *bytes, size_t len, uint32_t *words, size_t count);

/**
 * Unpacks the words of a 16-bit bus into a block. SW_E_ARGUMENT unless `count` words hold exactly `len` bytes.
 */
sw_result_t sw_rtex_from_words16(const uint16_t *words,
                                 size_t count,
                                 uint8_t *bytes,
                                 size_t len);

/**
 * Unpacks the words of a 32-bit bus into a block, as sw_rtex_from_words16().
 */
sw_result_t sw_rtex_from_words32(const uint32_t *words, size_t count, uint8_t *bytes, size_t len);

/**
 * Begins a non-cyclic command (sw_rtex_noncyclic_t) whose bytes 8 to 15 are `data`; an answer must come
 * within `limit` update periods. `attributes` 1: SW_RTEX_ALARM_COMMAND reads the attributes of the present
 * alarm. Normal and profile commands are not handshakes: SW_E_ARGUMENT.
 */
sw_result_t sw_rtex_handshake_start(sw_rtex_handshake_t *handshake,
                                    uint8_t mac_id,
                                    uint8_t cyclic,
                                    uint8_t noncyclic,
                                    const uint8_t *data,
                                    size_t len,
                                    uint32_t limit,
                                    uint8_t attributes);

/**
 * Bytes 8 to 15 of the command to send while it is pending.
 */
sw_result_t sw_rtex_handshake_data(const sw_rtex_handshake_t *handshake, uint8_t (*data)[8]);

/**
 * Takes the block of an update period, NULL if there was none; a refused block counts as none.
 * SW_PENDING; SW_OK with `done`; or SW_E_RTEX_EXECUTION, ..COMMAND_ERROR, ..TIMED_OUT.
 */
sw_result_t sw_rtex_handshake_hear(sw_rtex_handshake_t *handshake,
                                   const uint8_t *bytes,
                                   size_t len,
                                   sw_rtex_done_t *done);

/**
 * Begins a sub-command of the 32-byte mode: 2 system ID, 10 monitor.
 */
sw_result_t sw_rtex_sub_start(sw_rtex_sub_handshake_t *handshake,
                              uint8_t code,
                              uint8_t type_code,
                              uint16_t index,
                              uint32_t limit);

/**
 * Takes the sub block of an update period, 16 bytes, NULL if there was none; as sw_rtex_handshake_hear().
 */
sw_result_t sw_rtex_sub_hear(sw_rtex_sub_handshake_t *handshake,
                             const uint8_t *bytes,
                             size_t len,
                             sw_rtex_done_t *done);

/**
 * Begins a profile motion: Type_Code as the drive's manual gives it, target and speed in command units, limit in update periods.
 * `latch_sel1` (0..15) and `monitor_sel` are sent with it.
 */
sw_result_t sw_rtex_move_start(sw_rtex_move_t *motion,
                               uint8_t mac_id,
                               uint8_t type_code,
                               int32_t target,
                               int32_t speed,
                               uint32_t limit,
                               uint8_t latch_sel1,
                               uint8_t monitor_sel);

/**
 * The non-cyclic code (sw_rtex_noncyclic_t) and bytes 8 to 15 of the next command.
 */
sw_result_t sw_rtex_move_data(const sw_rtex_move_t *motion, uint8_t *noncyclic, uint8_t (*data)[8]);

/**
 * Takes the block of an update period, NULL if there was none; as sw_rtex_handshake_hear(), and
 * SW_E_RTEX_NOT_STARTED.
 */
sw_result_t sw_rtex_move_hear(sw_rtex_move_t *motion, const uint8_t *bytes, size_t len, sw_rtex_done_t *done);

/**
 * Prepares a ring that sends `invalid` update periods of invalid data before its first commands, in blocks
 * of 16 or 32 bytes.
 */
sw_result_t sw_rtex_ring_start(sw_rtex_ring_t *ring, uint8_t block_bytes, uint32_t invalid);

/**
 * Makes an update period of all axes, which were started and are in the order of the ring: takes the
 * blocks received, one after another, heard until `end_ns`, and writes those of the next period. As soon
 * as one axis fails the others stop in the same call. `rx` NULL: no frame came. SW_E_STATE if one of the
 * axes was not started, SW_E_ARGUMENT if two have the same MAC-ID or the memory has another size: nothing
 * was done.
 */
sw_result_t sw_rtex_ring_update(sw_rtex_ring_t *ring,
                                sw_rtex_axis_t *axes,
                                size_t count,
                                const uint8_t *rx,
                                size_t rx_len,
                                uint8_t *tx,
                                size_t tx_size,
                                uint64_t end_ns);

/**
 * The place of the axis that stopped the ring; SW_E_NO_VALUE if none has.
 */
sw_result_t sw_rtex_ring_failed(const sw_rtex_ring_t *ring);

/**
 * Forgets the failure; then clear each axis with sw_rtex_axis_clear().
 */
sw_result_t sw_rtex_ring_clear(sw_rtex_ring_t *ring);

/**
 * Compares a block with what was sent: sw_rtex_acknowledgement_t, or a refusal. `code` is cyclic * 16 + non-cyclic.
 */
sw_result_t sw_rtex_check_response(uint8_t block_bytes,
                                   uint8_t mac_id,
                                   uint8_t update_counter,
                                   uint8_t code,
                                   const uint8_t *bytes,
                                   size_t len);

/**
 * Finds the faults that a drive with this MAC-ID reports for a command.
 */
sw_result_t sw_rtex_check_command(uint8_t block_bytes,
                                  uint8_t mac_id,
                                  const uint8_t *bytes,
                                  size_t len,
                                  sw_rtex_verdict_t *verdict);

/**
 * Watches the Update_Counter_Echo: it trips after `limit` responses without a new one, 1 or more.
 */
sw_result_t sw_rtex_echo_start(sw_rtex_echo_t *echo, uint16_t limit);

/**
 * Takes the echo of a response, 0..3, or 255 for none; returns 1 if the watch has tripped, 0 if not.
 */
sw_result_t sw_rtex_echo_sample(sw_rtex_echo_t *echo, uint8_t update_counter);

/**
 * Prepares a counter that begins after `invalid` update periods of invalid data.
 */
sw_result_t sw_rtex_counter_start(sw_rtex_counter_t *counter, uint32_t invalid);

/**
 * The Update_Counter of the next command, 0..3; SW_PENDING * 256 (100h) while data are invalid: NOP and counter 0 are sent then.
 */
sw_result_t sw_rtex_counter_next(sw_rtex_counter_t *counter);

/**
 * The block that switches the servo off after a command, 16 bytes: counter advanced by one, Servo_On
 * cleared, everything else kept. SW_E_NO_VALUE if a drive would not evaluate Servo_On in it.
 */
sw_result_t sw_rtex_servo_off_after(const uint8_t *before, size_t len, uint8_t *bytes, size_t size);

/**
 * Whether a block certainly switches the servo off: 1 or 0, or a refusal.
 */
sw_result_t sw_rtex_is_servo_off(const uint8_t *bytes, size_t len);

/**
 * The frame of a master with this many bytes of output, from its source address to its time stamp, without preamble.
 */
sw_result_t sw_sorte_parse_master_frame(const uint8_t *bytes,
                                        size_t len,
                                        size_t output_len,
                                        sw_sorte_master_frame_t *frame);

/**
 * The frame of the IO exchange with this output: 5 bytes more.
 */
sw_result_t sw_sorte_build_master_frame(const uint8_t *output,
                                        size_t output_len,
                                        uint16_t time_stamp,
                                        uint8_t *bytes,
                                        size_t size,
                                        size_t *len);

/**
 * The frame of a device with this many bytes of payload, from its source address to its CRC.
 */
sw_result_t sw_sorte_parse_device_frame(const uint8_t *bytes,
                                        size_t len,
                                        size_t payload_len,
                                        sw_sorte_device_frame_t *frame);

/**
 * The frame of a device with the three bytes of payload of the published application: 6 bytes.
 */
sw_result_t sw_sorte_build_device_frame(const sw_sorte_device_frame_t *frame,
                                        const uint8_t *payload,
                                        uint8_t *bytes,
                                        size_t size);

/**
 * The word for a pulse that starts `sync_ns` into the cycle, 0..3990; 0 and 1 are sent as 1 ns.
 */
sw_result_t sw_sorte_pto_of_step(uint32_t sync_ns, uint8_t direction, uint16_t *word);

/**
 * Decodes a PTO word. A reserved one is refused with SW_E_SORTE_RESERVED_PTO_VALUE, but `pto` is filled in for inspection.
 */
sw_result_t sw_sorte_parse_pto(uint16_t word,
                               sw_sorte_pto_t *pto);

/**
 * The output for four axes, SW_SORTE_PAYLOAD bytes: a PTO word for each, commands 0. `count` is 4.
 */
sw_result_t sw_sorte_build_payload(const uint16_t *words, size_t count, uint8_t *bytes, size_t size);

/**
 * The output for one word, sent to the motors whose bit is set in `motors` (bit 0 is device 1). The others hold with the direction of
 * the word; without any motor all drivers are off.
 */
sw_result_t sw_sorte_build_shared_payload(uint16_t word,
                                          uint8_t motors,
                                          uint8_t *bytes,
                                          size_t size);

/**
 * The PTO words of an output of SW_SORTE_PAYLOAD bytes; reserved words are not refused.
 */
sw_result_t sw_sorte_parse_payload(const uint8_t *bytes, size_t len, uint16_t (*words)[4]);

/**
 * Continues the CRC-8 of the IO exchange over more bytes, after those that gave `crc`; it starts from 0.
 */
sw_result_t sw_sorte_crc8(const uint8_t *bytes, size_t len, uint8_t *crc);

/**
 * Where the frame begins after its preamble, which ends with D5h.
 */
sw_result_t sw_sorte_strip_preamble(const uint8_t *bytes, size_t len, size_t *at);

/**
 * A frame of the start-up, with all checks: destination, type, length, check sequence.
 */
sw_result_t sw_sorte_parse_header(const uint8_t *bytes, size_t len, sw_sorte_header_t *header);

/**
 * A PARAM frame.
 */
sw_result_t sw_sorte_parse_param(const uint8_t *bytes, size_t len, sw_sorte_param_t *param);

/**
 * The bytes of a PARAM frame, 40.
 */
sw_result_t sw_sorte_build_param(const sw_sorte_param_t *param, uint8_t *bytes, size_t size);

/**
 * A DELAY_REQ frame has nothing but its header: this makes its 8 bytes.
 */
sw_result_t sw_sorte_build_delay_req(uint8_t source, uint8_t status, uint8_t *bytes, size_t size);

/**
 * A SYNC frame.
 */
sw_result_t sw_sorte_parse_sync(const uint8_t *bytes, size_t len, sw_sorte_sync_t *sync);

/**
 * The bytes of a SYNC frame, 14.
 */
sw_result_t sw_sorte_build_sync(const sw_sorte_sync_t *sync, uint8_t *bytes, size_t size);

/**
 * Reads a DISCOVERY frame; sw_sorte_discovered() reads its table.
 */
sw_result_t sw_sorte_parse_discovery(const uint8_t *bytes, size_t len, sw_sorte_discovery_t *discovery);

/**
 * The bytes from and to the device at an address, in a DISCOVERY frame. SW_E_NO_VALUE if it has no entry.
 */
sw_result_t sw_sorte_discovered(const uint8_t *bytes,
                                size_t len,
                                uint8_t address,
                                uint16_t *input,
                                uint16_t *output);

/**
 * The DISCOVERY frame that a master sends, SW_SORTE_DISCOVERY bytes; `last` true for the last one of its
 * phase, which takes the devices to the next phase.
 */
sw_result_t sw_sorte_build_discovery(bool last, uint8_t *bytes, size_t size);

/**
 * Entry `i` of the published ramp, 0..31: 1000 / sin² of the step time at full speed; 0 for any other
 * index.
 */
uint32_t sw_step_ramp(uint8_t i);

/**
 * The speed constant for a step frequency in Hz.
 */
sw_result_t sw_step_speed(uint32_t hz, uint32_t *speed);

/**
 * The time of a step in ns: an entry of the ramp at a speed; modulo 2^32.
 */
uint32_t sw_step_time_ns(uint32_t entry, uint32_t speed);

/**
 * Computes the next step, `t_step` ns after one that came `prev` ns into its cycle.
 */
sw_result_t sw_step_next(uint32_t t_step, uint32_t prev, sw_step_time_t *time);

/**
 * The same as the PRU computes it, its errors included, for an entry of the ramp at a speed.
 */
sw_result_t sw_step_next_as_pru(uint32_t entry, uint32_t speed, uint32_t prev, sw_step_time_t *time);

/**
 * Whether a move with the published ramp is possible: `k` steps per entry, the first step `init_sync` ns
 * into its cycle. `pru_is_exact` (may be NULL) tells whether the PRU computes it without error.
 */
sw_result_t sw_step_check(uint32_t speed, uint32_t k, uint32_t init_sync, bool *pru_is_exact);

/**
 * How long a move of `steps` with the published ramp takes, ns.
 */
sw_result_t sw_step_duration_ns(uint32_t speed, uint32_t k, uint32_t init_sync, uint32_t steps, uint64_t *ns);

/**
 * Tells the shape of a move, with your own ramp of 32 entries, or with the published one if `table` is NULL.
 */
sw_result_t sw_step_shape(const uint32_t *table,
                          size_t len,
                          const sw_step_move_t *it,
                          sw_step_shape_t *shape);

/**
 * Writes the steps of a move from step `first` on, as many as there is room for: `count` is 0 after the last one. All steps before
 * `first` are computed again, so it may be at most SW_STEP_FIRST.
 */
sw_result_t sw_step_steps(const uint32_t *table,
                          size_t len,
                          const sw_step_move_t *it,
                          uint32_t first,
                          sw_step_step_t *steps,
                          size_t size,
                          size_t *count);

/**
 * Micro-step profile 0 (full steps) to 8 (256 micro-steps).
 */
sw_result_t sw_step_microstep(uint8_t code, sw_step_microstep_t *profile);

/**
 * Tone 0 to SW_STEP_TONES - 1: cis, E, fis, G, gis, A, H, cis2, D2, fis2.
 */
sw_result_t sw_step_tone(uint8_t number, sw_step_tone_t *tone);

/**
 * The response to a request from UART bytes; anything after it is ignored. Typed calls for IDs 0 to 3 are
 * faster.
 */
sw_result_t sw_tformat_parse(const sw_tformat_request_t *asked,
                             const uint8_t *bytes,
                             size_t len,
                             sw_tformat_response_t *response);

/**
 * The response from what a UART received since the request began, with the receiver on all the time: the
 * request itself, then the response.
 */
sw_result_t sw_tformat_parse_echoed(const sw_tformat_request_t *asked,
                                    const uint8_t *bytes,
                                    size_t len,
                                    sw_tformat_response_t *response);

/**
 * The response from line bits on a grid of ten bits a field, start bits and delimiters included: `bits` of them in `bytes`, in the
 * order of sw_bit_order_t. Anything after the response, and bits after the 128th, are ignored.
 */
sw_result_t sw_tformat_parse_line(const sw_tformat_request_t *asked,
                                  const uint8_t *bytes,
                                  size_t bits,
                                  uint8_t order,
                                  sw_tformat_response_t *response);

/**
 * Reads received fields as an encoder does: the request at the front.
 */
sw_result_t sw_tformat_parse_request(const uint8_t *bytes, size_t len, sw_tformat_request_t *asked);

/**
 * Returns why sw_tformat_parse() refuses these bytes. The result is the same as there.
 */
sw_result_t sw_tformat_why(const sw_tformat_request_t *asked,
                           const uint8_t *bytes,
                           size_t len,
                           sw_detail_t *why);

/**
 * The fields to send for a request, at most 4 bytes.
 */
sw_result_t sw_tformat_build(const sw_tformat_request_t *asked, uint8_t *bytes, size_t size, size_t *len);

/**
 * The line bits of a request, start bits and delimiters included, in the order of sw_bit_order_t, at most 40 bits in 5 bytes; `bits`
 * is how many. Bits after the last are 0.
 */
sw_result_t sw_tformat_build_line(const sw_tformat_request_t *asked,
                                  uint8_t order,
                                  uint8_t *bytes,
                                  size_t size,
                                  size_t *bits);

/**
 * The fields that an encoder sends, at most 11 bytes.
 */
sw_result_t sw_tformat_build_response(const sw_tformat_response_t *response,
                                      uint8_t *bytes,
                                      size_t size,
                                      size_t *len);

/**
 * The control field of a data ID, 0..15: sink code, ID and parity. IDs above 15 are cut.
 */
uint8_t sw_tformat_control_field(uint8_t id);

/**
 * The data ID of a control field, with its checks.
 */
sw_result_t sw_tformat_parse_control_field(uint8_t cf, uint8_t *id);

/**
 * The check field over these bytes, their XOR; 0 for NULL.
 */
uint8_t sw_tformat_crc(const uint8_t *bytes, size_t len);

/**
 * The widths that an encoder ID suggests; true if a document or a log shows them, false if they follow from a rule. Without a
 * suggestion the result is SW_E_NO_VALUE.
 */
sw_result_t sw_tformat_widths(uint8_t enid,
                              uint8_t *abs_bits,
                              uint8_t *abm_bits,
                              bool *documented);

/**
 * Switches a modelled encoder on: position 0, no alarms. `bits_per_second` is 2500000 or 5000000.
 */
sw_result_t sw_tformat_device_start(sw_tformat_device_t *device, uint8_t enid, uint32_t bits_per_second);

/**
 * Turns the shaft: ABS before the zero of ID 8 is applied, and ABM, 24 bits each.
 */
sw_result_t sw_tformat_device_set_position(sw_tformat_device_t *device, uint32_t abs, uint32_t abm);

/**
 * Sets the causes of these alarms (sw_tformat_almc_t, added), and removes those of all others. A latched
 * alarm stays until ID 7 or C.
 */
sw_result_t sw_tformat_device_set_alarms(sw_tformat_device_t *device, uint8_t almc);

/**
 * The EEPROM page that is selected, 0..5; 255 for a state that was not started.
 */
uint8_t sw_tformat_device_page(const sw_tformat_device_t *device);

/**
 * Takes a sound request that ended at `now_ns`: carries it out, and returns its response. SW_E_NO_VALUE if
 * the encoder is silent.
 */
sw_result_t sw_tformat_device_answer(sw_tformat_device_t *device,
                                     const sw_tformat_request_t *asked,
                                     uint64_t now_ns,
                                     sw_tformat_response_t *response);

/**
 * Takes bytes received without a framing error; the last one ended at `end_ns`. SW_SEND with `answer`
 * filled, or SW_PENDING.
 */
sw_result_t sw_tformat_device_hear(sw_tformat_device_t *device,
                                   const uint8_t *bytes,
                                   size_t len,
                                   uint64_t end_ns,
                                   sw_tformat_answer_t *answer);

/**
 * Reports a byte that ended at `end_ns` and was received with a framing error.
 */
sw_result_t sw_tformat_device_framing_error(sw_tformat_device_t *device,
                                            uint64_t end_ns,
                                            sw_tformat_answer_t *answer);

/**
 * Prepares a master: bits per second (2500000 or 5000000) and the widths of the encoder's single-turn data, 1..24 bits, and
 * multi-turn data, 0..24 bits.
 */
sw_result_t sw_tformat_init(sw_tformat_t *m,
                            uint32_t bits_per_second,
                            uint8_t abs_bits,
                            uint8_t abm_bits);

/**
 * Sets other widths, or turns of another kind (`flags`: sw_tformat_turns_t). The position that was heard last is dropped.
 */
sw_result_t sw_tformat_set_resolution(sw_tformat_t *m,
                                      uint8_t abs_bits,
                                      uint8_t abm_bits,
                                      uint8_t flags);

/**
 * Reads the present times of the line.
 */
sw_result_t sw_tformat_get_line(const sw_tformat_t *m, sw_tformat_line_t *line);

/**
 * Sets other times of the line, from the next request on. `echo` is 0 or 1.
 */
sw_result_t sw_tformat_set_line(sw_tformat_t *m, const sw_tformat_line_t *line);

/**
 * Sets the alarms (sum of sw_tformat_almc_t) that sw_tformat_angle() and sw_tformat_position() tolerate from now on, in addition to
 * their own.
 */
sw_result_t sw_tformat_tolerate(sw_tformat_t *m,
                                uint8_t almc);

/**
 * Begins a read: ID 0, 1, 2 or 3. The start bit of the request is on the line at `start_ns`, now or later.
 * The result is SW_SEND, and `to_send` is filled. SW_E_NOT_FREE while an exchange is pending, and before
 * the time of sw_tformat_until_ns().
 */
sw_result_t sw_tformat_read(sw_tformat_t *m,
                            uint8_t id,
                            uint64_t start_ns,
                            sw_tformat_transmission_t *to_send);

/**
 * Begins one exchange of any kind. IDs 6, 7, 8 and C change the encoder: use the procedures, which make
 * the necessary repetitions, waits and checks.
 */
sw_result_t sw_tformat_start(sw_tformat_t *m,
                             const sw_tformat_request_t *asked,
                             uint64_t start_ns,
                             sw_tformat_transmission_t *to_send);

/**
 * Takes bytes that were received back to back; the last one ended at `end_ns`, or was handed over within the latency of the line
 * after that. SW_PENDING, SW_OK with a response, or a refusal. SW_E_NO_VALUE if there was no request.
 */
sw_result_t sw_tformat_hear(sw_tformat_t *m,
                            const uint8_t *bytes,
                            size_t len,
                            uint64_t end_ns);

/**
 * Reports a framing error of the UART for the byte that ended at `end_ns`.
 */
sw_result_t sw_tformat_framing_error(sw_tformat_t *m, uint64_t end_ns);

/**
 * Ends an exchange whose time is over at `now_ns`. Hand over what was received before you call it.
 */
sw_result_t sw_tformat_poll(sw_tformat_t *m, uint64_t now_ns);

/**
 * While an exchange is pending, the time at which to poll it; afterwards, the time from which the line is
 * free. 0 if nothing was asked, SW_NO_TIME for a state that was not started.
 */
uint64_t sw_tformat_until_ns(const sw_tformat_t *m);

/**
 * The response of the exchange, once it has ended with SW_OK: raw fields. For control use sw_tformat_angle() and
 * sw_tformat_position().
 */
sw_result_t sw_tformat_response(const sw_tformat_t *m,
                                sw_tformat_response_t *response);

/**
 * The angle of the shaft for commutation, a turn is 2^32: **false if it must not be used, and the outputs
 * must be switched off.**
 *
 * It is judged now: no older than `max_age_ns` since it was sampled, from a sound response to this master's request, of the right
 * encoder, without alarms that concern the single turn (tolerated are OF, BA, BE, ME and OS, and what sw_tformat_tolerate() names).
 * `angle` is unchanged if the result is false.
 */
bool sw_tformat_angle(const sw_tformat_t *m,
                      uint64_t now_ns,
                      uint64_t max_age_ns,
                      uint32_t *angle);

/**
 * The position with its turns, judged now: false if it must not be used. Tolerated are OF and BA, and what sw_tformat_tolerate()
 * names. Turns come with ID 3. `position` is unchanged if the result is false.
 */
bool sw_tformat_position(const sw_tformat_t *m,
                         uint64_t now_ns,
                         uint64_t max_age_ns,
                         sw_position_t *position);

/**
 * Why sw_tformat_angle() is false: sw_tformat_doubt_t, or a refusal.
 */
sw_result_t sw_tformat_doubt(const sw_tformat_t *m, uint64_t now_ns, uint64_t max_age_ns);

/**
 * ID 7: clears all latched errors, ten requests. Position and turns stay. Continue with sw_tformat_next().
 */
sw_result_t sw_tformat_clear_errors(sw_tformat_procedure_t *p, uint64_t now_ns);

/**
 * ID 8: makes this position the zero of the turn, and reads the result back. **Shifts the commutation
 * angle of the motor.** The shaft must be at rest; `tolerance` is how far from zero, in counts, it may
 * appear to be afterwards.
 */
sw_result_t sw_tformat_zero_single_turn_and_shift_commutation_angle(sw_tformat_procedure_t *p,
                                                                    uint8_t abs_bits,
                                                                    uint32_t tolerance,
                                                                    uint64_t now_ns);

/**
 * ID C: clears turns and errors, and reads the result back. **The machine loses its multi-turn
 * reference.** `tolerance` is how many turns it may appear to be off zero afterwards.
 */
sw_result_t sw_tformat_clear_turns_and_lose_multi_turn_reference(sw_tformat_procedure_t *p,
                                                                 uint8_t abs_bits,
                                                                 uint8_t abm_bits,
                                                                 uint32_t tolerance,
                                                                 uint64_t now_ns);

/**
 * Reads the EEPROM byte at `address`, 0..126, of `page`, 0..7.
 */
sw_result_t sw_tformat_eeprom_read(sw_tformat_procedure_t *p, uint8_t page, uint8_t address, uint64_t now_ns);

/**
 * Writes an EEPROM byte and reads it back. Motor makers keep name plate and commutation data there: make
 * sure what is at the address.
 */
sw_result_t sw_tformat_eeprom_write(sw_tformat_procedure_t *p,
                                    uint8_t page,
                                    uint8_t address,
                                    uint8_t edf,
                                    uint64_t now_ns);

/**
 * Finds the encoder after power-on: after 1.5 s it tries 5 Mbit/s, then 2.5 Mbit/s. The master's line is
 * that of the encoder when it ends with SW_OK; the value is its ENID.
 */
sw_result_t sw_tformat_detect(sw_tformat_procedure_t *p, uint64_t power_on_ns);

/**
 * Returns what a procedure needs next: SW_SEND with `to_send` filled (the exchange has begun in the
 * master: hear and poll it until it ends, then call this again), SW_PENDING while the exchange runs, SW_OK
 * when the procedure is done, or why it failed.
 *
 * The first call begins. After the end the line and the encoder are free at sw_tformat_value()'s `ready_ns`.
 */
sw_result_t sw_tformat_next(sw_tformat_procedure_t *p,
                            sw_tformat_t *m,
                            uint64_t now_ns,
                            sw_tformat_transmission_t *to_send);

/**
 * Returns the result of a procedure that has ended with SW_OK: the EEPROM byte, ENID, ABM or ABS.
 * `ready_ns` (may be NULL) is the time from which the encoder accepts requests again; it is also set after
 * a failure, with the failure as the result.
 */
sw_result_t sw_tformat_value(const sw_tformat_procedure_t *p, uint32_t *value, uint64_t *ready_ns);

/**
 * The request in 10-bit SPI words, sent most significant bit first, one per field, at most 4. The idle
 * word 0x3ff follows.
 */
sw_result_t sw_tformat_build_spi10(const sw_tformat_request_t *asked,
                                   uint16_t *words,
                                   size_t size,
                                   size_t *count);

/**
 * The response from 10-bit SPI words, without the idle words received during the request.
 */
sw_result_t sw_tformat_parse_spi10(const sw_tformat_request_t *asked,
                                   const uint16_t *words,
                                   size_t count,
                                   sw_tformat_response_t *response);

/**
 * The words that a 16-bit SPI sends in a whole transaction, idle while the response comes; at most 10
 * words.
 */
sw_result_t sw_tformat_build_spi16(const sw_tformat_request_t *asked,
                                   uint16_t *words,
                                   size_t size,
                                   size_t *count);

/**
 * The response from the 16-bit SPI words received over a whole transaction.
 */
sw_result_t sw_tformat_parse_spi16(const sw_tformat_request_t *asked,
                                   const uint16_t *words,
                                   size_t count,
                                   sw_tformat_response_t *response);

/**
 * The response to ID 0 from UART bytes.
 */
sw_result_t sw_tformat_parse_single_turn(const uint8_t *bytes, size_t len, sw_tformat_single_turn_t *data);

/**
 * The response to ID 1 from UART bytes.
 */
sw_result_t sw_tformat_parse_multi_turn(const uint8_t *bytes, size_t len, sw_tformat_multi_turn_t *data);

/**
 * The response to ID 2 from UART bytes.
 */
sw_result_t sw_tformat_parse_encoder_id(const uint8_t *bytes, size_t len, sw_tformat_encoder_id_t *data);

/**
 * The response to ID 3 from UART bytes.
 */
sw_result_t sw_tformat_parse_all(const uint8_t *bytes, size_t len, sw_tformat_all_t *data);

/**
 * The release of the library: SERVOWIRE_VERSION, unless your program was compiled with the header of
 * another release. States and structs may then differ, so compare it once, before the first state is
 * started.
 */
uint32_t sw_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SERVOWIRE_H */
