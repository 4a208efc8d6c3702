/* RTEX. */
#include "rows.h"

static void say_data(const uint8_t *data)
{
    say_hex(data, 8);
}

/* HEX of a command: its fields, and the block built again. */
static void command(char **a, int n)
{
    block_t bytes = hex(a[0]);
    sw_rtex_command_t it;
    uint8_t back[16];
    sw_result_t r = sw_rtex_parse_command(bytes.at, bytes.len, &it);
    (void)n;
    say("%s", sw_text(r));
    if (r != SW_OK) {
        return;
    }
    say(" mac %u counter %u tmg %u cyclic %u noncyclic %u data1 %d", it.mac_id, it.update_counter, it.tmg_cnt, it.cyclic,
        it.noncyclic, it.command_data1);
    say(" servo_on %d gain_sw %d tl_sw %d homing_ctrl %d", (it.control & SW_RTEX_SERVO_ON) != 0, (it.control & SW_RTEX_GAIN_SW) != 0,
        (it.control & SW_RTEX_TL_SW) != 0, (it.control & SW_RTEX_HOMING_CTRL) != 0);
    say(" hard_stop %d smooth_stop %d pause %d sl_sw %d ex_out2 %d ex_out1 %d", (it.control & SW_RTEX_HARD_STOP) != 0,
        (it.control & SW_RTEX_SMOOTH_STOP) != 0, (it.control & SW_RTEX_PAUSE) != 0, (it.control & SW_RTEX_SL_SW) != 0,
        (it.control & SW_RTEX_EX_OUT2) != 0, (it.control & SW_RTEX_EX_OUT1) != 0);
    say_data(it.data);
    say(" %s", sw_text(sw_rtex_build_command(&it, back, sizeof back)));
    say_hex(back, sizeof back);
}

static void response(char **a, int n)
{
    static const struct {
        uint16_t bit;
        const char *name;
    } flags[] = {
        {SW_RTEX_SERVO_ACTIVE, "servo_active"}, {SW_RTEX_SERVO_READY, "servo_ready"}, {SW_RTEX_ALARM_FLAG, "alarm"},
        {SW_RTEX_WARNING, "warning"}, {SW_RTEX_TORQUE_LIMITED, "torque_limited"}, {SW_RTEX_HOMING_COMPLETE, "homing_complete"},
        {SW_RTEX_IN_PROGRESS, "in_progress"}, {SW_RTEX_IN_POSITION, "in_position"}, {SW_RTEX_SI_MON5, "si_mon5"},
        {SW_RTEX_SI_MON4, "si_mon4"}, {SW_RTEX_SI_MON3, "si_mon3"}, {SW_RTEX_SI_MON2, "si_mon2"}, {SW_RTEX_SI_MON1, "si_mon1"},
        {SW_RTEX_HOME, "home"}, {SW_RTEX_POT, "pot"}, {SW_RTEX_NOT, "not"},
    };
    block_t bytes = hex(a[0]);
    sw_rtex_response_t it;
    sw_result_t r = sw_rtex_parse_response(bytes.at, bytes.len, &it);
    size_t k;
    (void)n;
    say("%s", sw_text(r));
    if (r != SW_OK) {
        return;
    }
    say(" mac %u echo %u error %u cyclic %u noncyclic %u data1 %d", it.mac_id, it.update_counter_echo, it.cmd_error, it.cyclic,
        it.noncyclic, it.response_data1);
    for (k = 0; k < sizeof flags / sizeof *flags; k++) {
        say(" %s %d", flags[k].name, (it.status & flags[k].bit) != 0);
    }
    say_data(it.data);
}

/* MAC MODE UPDATE_NS GEAR GEAR ECHO COMMAND_ERRORS WAIT READY INACTIVE, then a step each: ACTION,VALUE,RESPONSE */
static void axis(char **a, int n)
{
    static const char *const states[] = {"starting", "off", "switching_on", "on", "stopping", "held", "switching_off", "stopped"};
    static const char *const reasons[] = {"", "echo_timeout", "wrong_mac_id", "refused", "receive_timeout", "alarm", "not_ready", "not_active",
        "ready_timeout", "active_timeout", "inactive_timeout", "command_error", "other_axis", "requested", "homing_timeout"};
    sw_rtex_axis_t it;
    sw_rtex_config_t config = {.mac_id = U8(a[0]), .mode = U8(a[1]), .update_ns = U32(a[2]), .gear_numerator = U32(a[3]),
        .gear_denominator = U32(a[4]), .echo = U16(a[5]), .command_errors = U16(a[6]), .wait = U32(a[7]), .ready = U32(a[8]),
        .inactive = U32(a[9])};
    sw_rtex_state_of_t state;
    int k;
    say("%s", sw_text(sw_rtex_axis_start(&it, &config)));
    for (k = 10; k < n; k++) {
        char *action = a[k], *value = strchr(action, ','), *text = value == NULL ? NULL : strchr(value + 1, ',');
        sw_result_t done = SW_OK;
        uint8_t block[16];
        block_t heard;
        if (text == NULL) {
            say(" not a step");
            return;
        }
        *value++ = 0;
        *text++ = 0;
        heard = hex(text);
        say(" %s", sw_text(sw_rtex_axis_hear(&it, heard.len > 0 ? heard.at : NULL, heard.len, 0)));
        if (strcmp(action, "switch_on") == 0) {
            (void)sw_rtex_axis_switch_on(&it);
        } else if (strcmp(action, "switch_off") == 0) {
            done = sw_rtex_axis_switch_off(&it);
        } else if (strcmp(action, "clear") == 0) {
            done = sw_rtex_axis_clear(&it);
        } else if (strcmp(action, "stop") == 0) {
            done = sw_rtex_axis_stop(&it, 0);
        } else if (strcmp(action, "set_position") == 0) {
            done = sw_rtex_axis_set_position(&it, (int32_t)signed_number(value));
        } else if (strcmp(action, "refused_position") == 0) {
            done = sw_rtex_axis_set_position(&it, (int32_t)signed_number(value)) < 0 ? SW_OK : SW_E_ARGUMENT;
        } else if (strcmp(action, "set_rate") == 0) {
            done = sw_rtex_axis_set_rate(&it, (int32_t)signed_number(value));
        } else if (strcmp(action, "set_control") == 0) {
            done = sw_rtex_axis_set_control(&it, U16(value));
        } else if (strcmp(action, "-") != 0) {
            say(" no action %s", action);
        }
        say(" %s", sw_text(done));
        (void)sw_rtex_axis_transmit(&it, block, sizeof block);
        (void)sw_rtex_axis_state(&it, &state);
        say(" %s", states[state.code]);
        if (state.reason != SW_RTEX_NO_REASON) {
            say(":%s", reasons[state.reason]);
        }
        if (state.reason == SW_RTEX_WRONG_MAC_ID) {
            say(":%u", state.detail);
        } else if (state.reason == SW_RTEX_COMMAND_ERROR) {
            say(":%04x", state.detail);
        }
        say_hex(block, 8);
    }
}

const entry_t rtex_commands[] = {{"rtex_command", command}, {"rtex_response", response}, {"rtex_axis", axis}, {NULL, NULL}};
