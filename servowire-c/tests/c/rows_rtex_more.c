/* RTEX: the 32-byte mode, checks, procedures, phases, numbers. */
#include "rows.h"

/* HEX of a command of 32 bytes: its sub block, and the block built again. */
static void command32(char **a, int n)
{
    block_t bytes = hex(a[0]);
    sw_rtex_command_t it;
    sw_rtex_sub_command_t sub;
    uint8_t back[32];
    sw_result_t r = sw_rtex_parse_command32(bytes.at, bytes.len, &it, &sub);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" sub %u %u %u %d %d %d", sub.code, sub.type_code, sub.index, sub.data1, sub.data2, sub.data3);
        say(" %s", sw_text(sw_rtex_build_command32(&it, &sub, back, sizeof back)));
        say_hex(back, sizeof back);
    }
}

static void response32(char **a, int n)
{
    block_t bytes = hex(a[0]);
    sw_rtex_response_t it;
    sw_rtex_sub_response_t sub;
    uint8_t back[32];
    sw_result_t r = sw_rtex_parse_response32(bytes.at, bytes.len, &it, &sub);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" sub %u error %u err %d wng %d busy %d %u %u %d %d %d", sub.code, sub.cmd_error, (sub.execution & SW_RTEX_ERR) != 0,
            (sub.execution & SW_RTEX_WNG) != 0, (sub.execution & SW_RTEX_BUSY) != 0, sub.type_code, sub.index, sub.data1, sub.data2,
            sub.data3);
        say(" %s", sw_text(sw_rtex_build_response32(&it, &sub, back, sizeof back)));
        say_hex(back, sizeof back);
    }
}

/* HEX of a response of 16 bytes, built again. */
static void rebuilt(char **a, int n)
{
    block_t bytes = hex(a[0]);
    sw_rtex_response_t it;
    uint8_t back[16];
    sw_result_t r = sw_rtex_parse_response(bytes.at, bytes.len, &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %s", sw_text(sw_rtex_build_response(&it, back, sizeof back)));
        say_hex(back, sizeof back);
    }
}

/* SIZE MAC COUNTER CODE HEX */
static void check(char **a, int n)
{
    static const char *const names[] = {"ok", "counter_not_echoed", "code_not_yet_echoed", "command_error"};
    block_t bytes = hex(a[4]);
    sw_result_t r = sw_rtex_check_response(U8(a[0]), U8(a[1]), U8(a[2]), (uint8_t)strtoul(a[3], NULL, 16), bytes.at, bytes.len);
    (void)n;
    say("%s", r < 0 ? sw_text(r) : names[r]);
}

/* SIZE MAC HEX: what a drive finds, and what decoding says of the main half and of the whole. */
static void drive(char **a, int n)
{
    block_t bytes = hex(a[2]), main_half;
    sw_rtex_verdict_t verdict = {0, 0, 0, 0};
    sw_rtex_command_t it;
    sw_rtex_sub_command_t sub;
    (void)n;
    say("%s", sw_text(sw_rtex_check_command(U8(a[0]), U8(a[1]), bytes.at, bytes.len, &verdict)));
    say(" %04x %04x %u.%u", verdict.error, verdict.sub_error, verdict.alarm_main, verdict.alarm_sub);
    main_half = bytes;
    main_half.len = 16;
    say(" %s", sw_text(sw_rtex_parse_command(main_half.at, main_half.len, &it)));
    say(" %s", U8(a[0]) == 32 ? sw_text(sw_rtex_parse_command32(bytes.at, bytes.len, &it, &sub)) : "-");
    {
        uint16_t control = (uint16_t)(bytes.at[2] | bytes.at[3] << 8);
        say(" reserved %d", sw_rtex_known_control(control) != control);
    }
}

/* BYTE0: which direction it has, and what it says. */
static void byte0(char **a, int n)
{
    uint8_t block[16] = {0};
    sw_rtex_command_t sent;
    sw_rtex_response_t back;
    sw_result_t r;
    (void)n;
    block[0] = (uint8_t)strtoul(a[0], NULL, 16);
    r = sw_rtex_parse_command(block, sizeof block, &sent);
    if (r == SW_OK) {
        say("0 %u %u", sent.update_counter, sent.mac_id);
        (void)sw_rtex_build_command(&sent, block, sizeof block);
    } else if (r == SW_E_RTEX_DIRECTION && sw_rtex_parse_response(block, sizeof block, &back) == SW_OK) {
        say("1 %u %u", back.update_counter_echo, back.mac_id);
        (void)sw_rtex_build_response(&back, block, sizeof block);
    }
    say(" %02x", block[0]);
}

/* BYTE1 of a response and of a command. */
static void byte1(char **a, int n)
{
    uint8_t block[16] = {0x80}, sent[16] = {0};
    sw_rtex_response_t it;
    sw_rtex_command_t command;
    sw_rtex_verdict_t verdict;
    sw_result_t r;
    (void)n;
    block[1] = sent[1] = (uint8_t)strtoul(a[0], NULL, 16);
    (void)sw_rtex_parse_response(block, sizeof block, &it);
    (void)sw_rtex_build_response(&it, block, sizeof block);
    say("%u %u %u %02x", it.cmd_error, it.cyclic, it.noncyclic, block[1]);
    (void)sw_rtex_check_command(16, 0, sent, sizeof sent, &verdict);
    r = sw_rtex_parse_command(sent, sizeof sent, &command);
    say(" %04x %s", verdict.error, sw_text(r));
    if (r == SW_OK) {
        (void)sw_rtex_build_command(&command, sent, sizeof sent);
        say(" %u %02x", command.tmg_cnt, sent[1]);
    }
}

/* BYTES 2 and 3 of a command: without the reserved bits, and as both kinds of decoding take them. */
static void control(char **a, int n)
{
    uint8_t block[16] = {0};
    block_t bytes = hex(a[0]);
    sw_rtex_command_t it;
    uint16_t known = sw_rtex_known_control((uint16_t)(bytes.at[0] | bytes.at[1] << 8));
    (void)n;
    block[1] = 0x20;
    block[2] = bytes.at[0];
    block[3] = bytes.at[1];
    say("%02x%02x %s", known & 0xff, known >> 8, sw_text(sw_rtex_parse_command(block, sizeof block, &it)));
    say(" %s", sw_text(sw_rtex_parse_command_strict(block, sizeof block, &it)));
}

/* BEFORE OFF: whether OFF switches the servo off, whether it is the one that is made after BEFORE, and by how much the counter goes on. */
static void servo_off(char **a, int n)
{
    block_t before = hex(a[0]), off = hex(a[1]);
    uint8_t made[16];
    sw_result_t r = sw_rtex_servo_off_after(before.at, before.len, made, sizeof made);
    (void)n;
    say("%d %d %d", sw_rtex_is_servo_off(off.at, off.len), r == SW_OK && memcmp(made, off.at, sizeof made) == 0,
        ((off.at[0] >> 5) - (before.at[0] >> 5)) & 3);
}

/* LIMIT, echoes */
static void echo(char **a, int n)
{
    sw_rtex_echo_t it;
    int k;
    say("%s", sw_text(sw_rtex_echo_start(&it, U16(a[0]))));
    for (k = 1; k < n; k++) {
        say(" %d", sw_rtex_echo_sample(&it, U8(a[k])));
    }
}

/* INVALID COUNT */
static void counter(char **a, int n)
{
    sw_rtex_counter_t it;
    uint32_t k;
    (void)n;
    say("%s", sw_text(sw_rtex_counter_start(&it, U32(a[0]))));
    for (k = U32(a[1]); k > 0; k--) {
        sw_result_t next = sw_rtex_counter_next(&it);
        say(next > 3 ? " 0:00" : " %d:20", next);
    }
}

static void say_done(sw_result_t r, const sw_rtex_done_t *done)
{
    if (r == SW_E_RTEX_COMMAND_ERROR) {
        say(" %04x", done->index);
    } else {
        say(" %s", sw_text(r));
    }
    if (r == SW_OK) {
        say(" %d %u %u %u", done->data, done->index, done->warning, done->in_position);
    }
}

/* MAC CODE DATA LIMIT ATTRIBUTES, responses */
static void handshake(char **a, int n)
{
    uint8_t code = (uint8_t)strtoul(a[1], NULL, 16), out[8];
    block_t data = hex(a[2]);
    sw_rtex_handshake_t it;
    int k;
    say("%s", sw_text(sw_rtex_handshake_start(&it, U8(a[0]), code >> 4, code & 15, data.at, data.len, U32(a[3]), U8(a[4]))));
    say(" %s", sw_text(sw_rtex_handshake_data(&it, &out)));
    say_hex(out, sizeof out);
    for (k = 5; k < n; k++) {
        block_t block = hex(a[k]);
        sw_rtex_done_t done = {0, 0, 0, 0};
        say_done(sw_rtex_handshake_hear(&it, block.len > 0 ? block.at : NULL, block.len, &done), &done);
    }
}

/* CODE TYPE INDEX LIMIT, sub blocks */
static void sub(char **a, int n)
{
    sw_rtex_sub_handshake_t it;
    int k;
    say("%s", sw_text(sw_rtex_sub_start(&it, U8(a[0]), U8(a[1]), U16(a[2]), U32(a[3]))));
    for (k = 4; k < n; k++) {
        block_t block = hex(a[k]);
        sw_rtex_done_t done = {0, 0, 0, 0};
        say_done(sw_rtex_sub_hear(&it, block.len > 0 ? block.at : NULL, block.len, &done), &done);
    }
}

/* MAC TYPE TARGET SPEED LIMIT LATCH MONITOR, responses */
static void move(char **a, int n)
{
    sw_rtex_move_t it;
    int k;
    say("%s", sw_text(sw_rtex_move_start(&it, U8(a[0]), U8(a[1]), (int32_t)signed_number(a[2]), (int32_t)signed_number(a[3]), U32(a[4]),
        U8(a[5]), U8(a[6]))));
    for (k = 7; k < n; k++) {
        block_t block = hex(a[k]);
        sw_rtex_done_t done = {0, 0, 0, 0};
        uint8_t code = 0, data[8];
        say_done(sw_rtex_move_hear(&it, block.len > 0 ? block.at : NULL, block.len, &done), &done);
        (void)sw_rtex_move_data(&it, &code, &data);
        say(" %02x", 0x10 | code);
        if (code == SW_RTEX_PROFILE) {
            say(" %u %u %u %d", data[0], data[2] & 15u, data[3], (int)((uint32_t)data[4] | (uint32_t)data[5] << 8 |
                (uint32_t)data[6] << 16 | (uint32_t)data[7] << 24));
        }
    }
}

/* ASIC,SLAVE_INFO,TX_READY,TIMEOUT each */
static void phases(char **a, int n)
{
    sw_rtex_phases_t it;
    int k;
    say("%s", sw_text(sw_rtex_phases_start(&it)));
    for (k = 0; k < n; k++) {
        sw_rtex_inputs_t inputs;
        inputs.asic = (uint8_t)(a[k][0] - '0');
        inputs.slave_info = (uint8_t)(a[k][2] - '0');
        inputs.tx_ready = (uint8_t)(a[k][4] - '0');
        inputs.timeout = (uint8_t)(a[k][6] - '0');
        say(" %d", sw_rtex_phases_step(&it, &inputs));
        say(":%d", sw_rtex_phases_fault(&it));
    }
}

static void led(char **a, int n)
{
    static const char *const names[] = {"off", "green", "red"};
    (void)n;
    say("%s", names[sw_rtex_led(U8(a[0]), U8(a[1]), number(a[2]))]);
}

static void periods(char **a, int n)
{
    sw_rtex_periods_t it;
    sw_result_t r = sw_rtex_periods_a6n((int32_t)signed_number(a[0]), (int32_t)signed_number(a[1]), signed_number(a[2]), &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u %u %u", it.com_ns, it.update_ns, it.internal_timer);
    }
}

static void frame_time(char **a, int n)
{
    (void)n;
    if (strcmp(a[0], "axes") == 0) {
        say("%llu", (unsigned long long)sw_rtex_frame_ns(U32(a[1])));
    } else {
        say("%u", sw_rtex_axes_within(U32(a[1])));
    }
}

static void reload(char **a, int n)
{
    uint32_t it = 0;
    sw_result_t r = sw_rtex_timer_reload(U32(a[0]), U32(a[1]), &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u", it);
    }
}

static void step(char **a, int n)
{
    (void)n;
    say("%d", sw_rtex_step((int32_t)signed_number(a[0]), (int32_t)signed_number(a[1])));
}

static void rate(char **a, int n)
{
    (void)n;
    say("%d", sw_rtex_is_within_limit((int32_t)signed_number(a[0]), U32(a[1]), U32(a[2]), U32(a[3])));
}

/* Names of the header under the names of the rows. */
static void constant(char **a, int n)
{
    static const struct {
        const char *name;
        long value;
    } named[] = {
        {"code.nop", SW_RTEX_NOP << 4 | SW_RTEX_NORMAL}, {"code.profile_idle", SW_RTEX_PP << 4 | SW_RTEX_NORMAL},
        {"code.profile_start", SW_RTEX_PP << 4 | SW_RTEX_PROFILE}, {"code.cyclic_position", SW_RTEX_CP << 4 | SW_RTEX_NORMAL},
        {"cyclic.nop", SW_RTEX_NOP}, {"cyclic.pp", SW_RTEX_PP}, {"cyclic.cp", SW_RTEX_CP}, {"cyclic.cv", SW_RTEX_CV},
        {"cyclic.ct", SW_RTEX_CT}, {"noncyclic.normal", SW_RTEX_NORMAL}, {"noncyclic.reset", SW_RTEX_RESET},
        {"noncyclic.system_id", SW_RTEX_SYSTEM_ID}, {"noncyclic.homing", SW_RTEX_HOMING}, {"noncyclic.alarm", SW_RTEX_ALARM_COMMAND},
        {"noncyclic.parameter", SW_RTEX_PARAMETER}, {"noncyclic.profile", SW_RTEX_PROFILE}, {"noncyclic.monitor", SW_RTEX_MONITOR},
        {"sub.normal", SW_RTEX_NORMAL}, {"sub.system_id", SW_RTEX_SYSTEM_ID}, {"sub.monitor", SW_RTEX_MONITOR},
        {"control.servo_on", SW_RTEX_SERVO_ON}, {"control.gain_sw", SW_RTEX_GAIN_SW}, {"control.tl_sw", SW_RTEX_TL_SW},
        {"control.homing_ctrl", SW_RTEX_HOMING_CTRL}, {"control.hard_stop", SW_RTEX_HARD_STOP},
        {"control.smooth_stop", SW_RTEX_SMOOTH_STOP}, {"control.pause", SW_RTEX_PAUSE}, {"control.sl_sw", SW_RTEX_SL_SW},
        {"control.ex_out2", SW_RTEX_EX_OUT2}, {"control.ex_out1", SW_RTEX_EX_OUT1}, {"status.servo_active", SW_RTEX_SERVO_ACTIVE},
        {"status.servo_ready", SW_RTEX_SERVO_READY}, {"status.alarm", SW_RTEX_ALARM_FLAG}, {"status.warning", SW_RTEX_WARNING},
        {"status.torque_limited", SW_RTEX_TORQUE_LIMITED}, {"status.homing_complete", SW_RTEX_HOMING_COMPLETE},
        {"status.in_progress", SW_RTEX_IN_PROGRESS}, {"status.in_position", SW_RTEX_IN_POSITION}, {"status.si_mon5", SW_RTEX_SI_MON5},
        {"status.si_mon4", SW_RTEX_SI_MON4}, {"status.si_mon3", SW_RTEX_SI_MON3}, {"status.si_mon2", SW_RTEX_SI_MON2},
        {"status.si_mon1", SW_RTEX_SI_MON1}, {"status.home", SW_RTEX_HOME}, {"status.pot", SW_RTEX_POT}, {"status.not", SW_RTEX_NOT},
        {"execution.err", SW_RTEX_ERR}, {"execution.wng", SW_RTEX_WNG}, {"execution.busy", SW_RTEX_BUSY},
        {"latch.latch_comp1", SW_RTEX_LATCH_COMP1}, {"latch.latch_comp2", SW_RTEX_LATCH_COMP2}, {"profile.psl", SW_RTEX_PSL},
        {"profile.nsl", SW_RTEX_NSL}, {"profile.near", SW_RTEX_NEAR}, {"profile.latch_comp1", SW_RTEX_LATCH_COMP1},
        {"error.mac_id", SW_RTEX_ERROR_MAC_ID}, {"error.direction", SW_RTEX_ERROR_DIRECTION},
        {"error.cyclic_code", SW_RTEX_ERROR_CYCLIC_CODE}, {"error.non_cyclic_code", SW_RTEX_ERROR_NON_CYCLIC_CODE},
        {"error.cyclic_mode", SW_RTEX_ERROR_CYCLIC_MODE}, {"error.type_code", SW_RTEX_ERROR_TYPE_CODE},
        {"error.argument", SW_RTEX_ERROR_ARGUMENT}, {"error.feed_forward", SW_RTEX_ERROR_FEED_FORWARD},
        {"alarm.command_step", SW_RTEX_ALARM_COMMAND_STEP}, {"alarm.cyclic_data", SW_RTEX_ALARM_CYCLIC_DATA},
        {"alarm.cyclic_code", SW_RTEX_ALARM_CYCLIC_CODE}, {"alarm.update_counter", SW_RTEX_ALARM_UPDATE_COUNTER},
        {"alarm.command", SW_RTEX_ALARM_COMMAND_WRONG}, {"type.reset.software", SW_RTEX_TYPE_1},
        {"type.reset.attribute_c", SW_RTEX_TYPE_11H}, {"type.system_id.vendor_name", SW_RTEX_TYPE_1},
        {"type.system_id.device_type", SW_RTEX_TYPE_5}, {"type.system_id.model", SW_RTEX_TYPE_12H},
        {"type.system_id.serial_number", SW_RTEX_TYPE_SERIAL_NUMBER}, {"type.system_id.software_version", SW_RTEX_TYPE_SOFTWARE_VERSION},
        {"type.system_id.driver_type", SW_RTEX_TYPE_DRIVER_TYPE}, {"type.system_id.scale_vendor_id", SW_RTEX_TYPE_SCALE_VENDOR_ID},
        {"type.system_id.scale_model_id", SW_RTEX_TYPE_SCALE_MODEL_ID},
        {"type.homing.set_actual_position", SW_RTEX_TYPE_SET_ACTUAL_POSITION},
        {"type.homing.set_command_position", SW_RTEX_TYPE_SET_COMMAND_POSITION}, {"type.homing.latch_state", SW_RTEX_TYPE_LATCH_STATE},
        {"type.parameter.write", SW_RTEX_TYPE_11H}, {"type.profile.relative", SW_RTEX_TYPE_11H}, {"type.monitor.perr", SW_RTEX_TYPE_1},
        {"type.monitor.mpos", SW_RTEX_TYPE_MPOS}, {"type.monitor.aspd", SW_RTEX_TYPE_5}, {"type.monitor.trq", SW_RTEX_TYPE_TRQ},
        {"type.monitor.apos", SW_RTEX_TYPE_APOS}, {"type.monitor.ipos", SW_RTEX_TYPE_IPOS}, {"type.monitor.lpos1", SW_RTEX_TYPE_LPOS1},
        {"type.monitor.lpos2", SW_RTEX_TYPE_LPOS2}, {"type.monitor.mspd", SW_RTEX_TYPE_MSPD},
        {"type.monitor.regenerative_load", SW_RTEX_TYPE_11H}, {"type.monitor.overload", SW_RTEX_TYPE_12H},
        {"ring.most_axes", SW_RTEX_AXES},
    };
    const char *name = a[0];
    size_t k;
    (void)n;
    for (k = 0; k < sizeof named / sizeof *named; k++) {
        if (strcmp(named[k].name, name) == 0) {
            say("%ld", named[k].value);
            return;
        }
    }
    if (strcmp(name, "conventional.system_id.vendor_name") == 0) {
        say("%d", sw_rtex_conventional(SW_RTEX_SYSTEM_ID, SW_RTEX_TYPE_1));
    } else if (strcmp(name, "conventional.system_id.model") == 0) {
        say("%d", sw_rtex_conventional(SW_RTEX_SYSTEM_ID, SW_RTEX_TYPE_12H));
    } else if (strcmp(name, "conventional.system_id.scale_model_id") == 0) {
        say("%d", sw_rtex_conventional(SW_RTEX_SYSTEM_ID, SW_RTEX_TYPE_SCALE_MODEL_ID));
    } else if (strcmp(name, "conventional.monitor.perr") == 0) {
        say("%d", sw_rtex_conventional(SW_RTEX_MONITOR, SW_RTEX_TYPE_1));
    } else if (strcmp(name, "conventional.monitor.overload") == 0) {
        say("%d", sw_rtex_conventional(SW_RTEX_MONITOR, SW_RTEX_TYPE_12H));
    } else if (strcmp(name, "index.pr7_20") == 0) {
        say("%u", sw_rtex_parameter_index(7, 20));
    } else if (strcmp(name, "frame.one_axis_ns") == 0) {
        say("%llu", (unsigned long long)sw_rtex_frame_ns(1));
    } else if (strcmp(name, "frame.full_ns") == 0) {
        say("%llu", (unsigned long long)sw_rtex_frame_ns(32));
    } else if (strcmp(name, "position.max_pulses_per_s") == 0) {
        /* The largest step in a millisecond. */
        int32_t most = 0;
        while (sw_rtex_is_within_limit(most + 1, 1000000, 1, 1) == 1) {
            most++;
        }
        say("%lld", (long long)most * 1000);
    } else if (strcmp(name, "led.half_period_ms") == 0) {
        uint64_t t = 0;
        while (sw_rtex_led(SW_RTEX_PH_PREPARE, SW_RTEX_NO_FAULT, t) != SW_RTEX_LED_OFF) {
            t++;
        }
        say("%llu", (unsigned long long)t);
    } else if (strcmp(name, "block.bytes") == 0 || strcmp(name, "block.bytes32") == 0) {
        /* The shortest block that is taken. */
        static const uint8_t block[32] = {0x80};
        sw_rtex_response_t it;
        sw_rtex_sub_response_t second;
        size_t len = 0;
        while (len < 32 && (name[11] ? sw_rtex_parse_response32(block, len, &it, &second) : sw_rtex_parse_response(block, len, &it)) == SW_E_RTEX_TRUNCATED) {
            len++;
        }
        say("%u", (unsigned)len);
    } else {
        say("no such constant");
    }
}

/* A block: its words, and the block that they make again. */
static void words(char **a, int n)
{
    block_t block = hex(a[0]);
    uint32_t wide[8];
    uint16_t narrow[16];
    uint8_t back[32];
    size_t k, count = block.len / 4;
    (void)n;
    say("%s", sw_text(sw_rtex_to_words32(block.at, block.len, wide, count)));
    for (k = 0; k < count; k++) {
        say(" %08x", wide[k]);
    }
    say(" %s", sw_text(sw_rtex_from_words32(wide, count, back, block.len)));
    say(" %d", memcmp(back, block.at, block.len) == 0);
    memset(back, 0, sizeof back);
    say(" %s", sw_text(sw_rtex_to_words16(block.at, block.len, narrow, 2 * count)));
    for (k = 0; k < 2 * count; k++) {
        say(" %04x", narrow[k]);
    }
    say(" %s", sw_text(sw_rtex_from_words16(narrow, 2 * count, back, block.len)));
    say(" %d", memcmp(back, block.at, block.len) == 0);
    say(" %s", sw_text(sw_rtex_to_words32(block.at, block.len, wide, count - 1)));
}

const entry_t rtex_more_commands[] = {
    {"rtex_words", words},
    {"rtex_command32", command32}, {"rtex_response32", response32}, {"rtex_rebuilt", rebuilt}, {"rtex_check", check},
    {"rtex_drive", drive}, {"rtex_byte0", byte0}, {"rtex_byte1", byte1}, {"rtex_control", control}, {"rtex_servo_off", servo_off},
    {"rtex_echo", echo}, {"rtex_counter", counter}, {"rtex_handshake", handshake}, {"rtex_sub", sub}, {"rtex_move", move},
    {"rtex_phases", phases}, {"rtex_led", led}, {"rtex_periods", periods}, {"rtex_frame_time", frame_time}, {"rtex_reload", reload},
    {"rtex_step", step}, {"rtex_rate", rate}, {"rtex_constant", constant}, {NULL, NULL},
};
