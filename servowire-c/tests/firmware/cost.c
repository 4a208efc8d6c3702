/* Instructions of a call, of a Cortex-M4, beside those of the same call of the crates (cost.rs): with `-icount shift=0` an instruction
 * takes 1 ns, and a tick of the SysTick of this board 40. The empty call is subtracted. */
#include "servowire.h"
#include "start.h"

#define SYST_CSR (*(volatile uint32_t *)0xe000e010u)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014u)
#define SYST_CVR (*(volatile uint32_t *)0xe000e018u)

/* The kernels of comparison. Their states and values are Rust's: memory of 1024 bytes for each. */
typedef struct {
    uint64_t memory[128];
} place_t;
int32_t rust_parse_all(const uint8_t *bytes, size_t len, place_t *data);
int32_t rust_parse_single(const uint8_t *bytes, size_t len, place_t *data);
int32_t rust_parse_any(const void *request, const uint8_t *bytes, size_t len, place_t *response);
const void *rust_start(place_t *m);
int32_t rust_read(place_t *m, uint64_t start_ns, place_t *tx);
int32_t rust_hear(place_t *m, const uint8_t *bytes, size_t len, uint64_t end_ns);
int32_t rust_poll(place_t *m, uint64_t now_ns);
bool rust_angle(const place_t *m, uint64_t now_ns, uint64_t max_age_ns, uint32_t *angle);
void rust_bus_start(place_t *bus, uint8_t addresses);
int32_t rust_bus_push(place_t *bus, const uint16_t *words, size_t count, bool msb_first, place_t *verdict);
void rust_rtex_start(place_t *axis);
int32_t rust_rtex_parse(const uint8_t *bytes, size_t len, place_t *response);
int32_t rust_rtex_hear(place_t *axis, const uint8_t *bytes, size_t len, uint64_t end_ns);
int32_t rust_rtex_transmit(place_t *axis, uint8_t *bytes);
bool rust_rtex_feedback(const place_t *axis, uint64_t now_ns, uint64_t max_age_ns, int32_t *position);
void rust_hdsl_start(place_t *m);
int32_t rust_hdsl_hear(place_t *m, uint64_t bits, uint64_t end_ns);
int32_t rust_sorte_device(const uint8_t *bytes, size_t len, size_t payload, place_t *frame);
int32_t rust_step_next(uint32_t t_step, uint32_t prev, place_t *time);

/* T-Format ID 3 and ID 0, A-format ABS40 of EA 3, an RTEX response of drive 5, a SORTE device frame: published ones. */
static const uint8_t all[11] = {0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0x00, 0xdf};
static const uint8_t single[6] = {0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37};
static const uint16_t abs40[4] = {0x3880, 0x01ca, 0x4800, 0x00b8};
static const uint8_t block[16] = {0xc5, 0x20, 0xc1, 0, 0xe8, 0x03, 0, 0, 0x10, 0x27, 0, 0, 0x9c, 0xff, 0xff, 0xff};
static const uint8_t device[6] = {0x01, 0x04, 0x3d, 0x00, 0x00, 0x4a};

static const sw_tformat_request_t ask_all = {SW_TFORMAT_READ_ALL, 0, 0};
static const void *rust_ask_all;
static sw_tformat_all_t all_data;
static sw_tformat_single_turn_t single_data;
static sw_tformat_response_t response;
static sw_tformat_t m;
static sw_tformat_transmission_t tx;
static sw_aformat_bus_t bus;
static sw_aformat_abs40_t position;
static const sw_rtex_config_t config = {500000, 0, 1000, 0, 0, 1, 1, 3, 1, 5, SW_RTEX_CP};
static sw_rtex_axis_t axis;
static sw_rtex_response_t drive;
static sw_rtex_feedback_t feedback;
static sw_hdsl_t dsl;
static sw_sorte_device_frame_t frame;
static sw_step_time_t step;
static sw_clock_t clk;
static place_t rust_m, rust_bus, rust_axis, rust_dsl, rust_out;
static uint8_t sent[16];
static uint32_t angle, ticks_now;
static int32_t actual;
static uint64_t begin_ns;
static volatile sw_result_t sink;

static sw_result_t empty(void)
{
    __asm__ volatile("");
    return 0;
}
static sw_result_t parse_all(void) { return sw_tformat_parse_all(all, 11, &all_data); }
static sw_result_t parse_all_rust(void) { return rust_parse_all(all, 11, &rust_out); }
static sw_result_t parse_single(void) { return sw_tformat_parse_single_turn(single, 6, &single_data); }
static sw_result_t parse_single_rust(void) { return rust_parse_single(single, 6, &rust_out); }
static sw_result_t parse_any(void) { return sw_tformat_parse(&ask_all, all, 11, &response); }
static sw_result_t parse_any_rust(void) { return rust_parse_any(rust_ask_all, all, 11, &rust_out); }
static sw_result_t exchange(void)
{
    begin_ns += 100000;
    (void)sw_tformat_read(&m, SW_TFORMAT_READ_ALL, begin_ns, &tx);
    return sw_tformat_hear(&m, all, 11, begin_ns + 51000);
}
static sw_result_t exchange_rust(void)
{
    begin_ns += 100000;
    (void)rust_read(&rust_m, begin_ns, &rust_out);
    return rust_hear(&rust_m, all, 11, begin_ns + 51000);
}
static sw_result_t poll(void) { return sw_tformat_poll(&m, begin_ns + 60000); }
static sw_result_t poll_rust(void) { return rust_poll(&rust_m, begin_ns + 60000); }
static sw_result_t judged(void) { return sw_tformat_angle(&m, begin_ns + 60000, UINT32_MAX, &angle) ? 0 : -1; }
static sw_result_t judged_rust(void) { return rust_angle(&rust_m, begin_ns + 60000, UINT32_MAX, &angle) ? 0 : -1; }
static sw_result_t push(void) { return sw_aformat_bus_push_abs40(&bus, abs40, 4, SW_MSB_FIRST, &position); }
static sw_result_t push_rust(void) { return rust_bus_push(&rust_bus, abs40, 4, true, &rust_out); }
static sw_result_t parse_block(void) { return sw_rtex_parse_response(block, 16, &drive); }
static sw_result_t parse_block_rust(void) { return rust_rtex_parse(block, 16, &rust_out); }
static sw_result_t hear_block(void)
{
    begin_ns += 500000;
    return sw_rtex_axis_hear(&axis, block, 16, begin_ns);
}
static sw_result_t hear_block_rust(void)
{
    begin_ns += 500000;
    return rust_rtex_hear(&rust_axis, block, 16, begin_ns);
}
static sw_result_t transmit(void) { return sw_rtex_axis_transmit(&axis, sent, 16); }
static sw_result_t transmit_rust(void) { return rust_rtex_transmit(&rust_axis, sent); }
static sw_result_t fed_back(void) { return sw_rtex_feedback(&axis, begin_ns, UINT32_MAX, &feedback) ? 0 : 1; }
static sw_result_t fed_back_rust(void) { return rust_rtex_feedback(&rust_axis, begin_ns, UINT32_MAX, &actual) ? 0 : 1; }
/* Silence, which begins the start-up again and again. */
static sw_result_t hear_bits(void)
{
    begin_ns += 11500;
    return sw_hdsl_hear_bits(&dsl, UINT64_MAX, begin_ns);
}
static sw_result_t hear_bits_rust(void)
{
    begin_ns += 11500;
    return rust_hdsl_hear(&rust_dsl, UINT64_MAX, begin_ns);
}
static sw_result_t parse_device(void) { return sw_sorte_parse_device_frame(device, 6, 3, &frame); }
static sw_result_t parse_device_rust(void) { return rust_sorte_device(device, 6, 3, &rust_out); }
static sw_result_t next(void) { return sw_step_next(14234, 3000, &step); }
static sw_result_t next_rust(void) { return rust_step_next(14234, 3000, &rust_out); }
static sw_result_t clock_ns(void)
{
    ticks_now += 1000;
    return (sw_result_t)(sw_clock_ns(&clk, ticks_now) & 1);
}

static uint32_t ticks(sw_result_t (*volatile call)(void))
{
    uint32_t sum = 0, begin = SYST_CVR, k;
    for (k = 0; k < 4000; k++) {
        uint32_t now;
        sink = call();
        now = SYST_CVR;
        sum += (begin - now) & 0xffffffu;
        begin = now;
    }
    return sum;
}

static uint32_t instructions(sw_result_t (*call)(void)) { return (ticks(call) - ticks(empty) + 50) / 100; }

static int worst;

static void say(const char *name, uint32_t measured, const char *of, uint32_t limit)
{
    print(name);
    print(" ");
    print_number(measured);
    print(of);
    print_number(limit);
    print(measured > limit ? " TOO MANY\n" : "\n");
    worst |= measured > limit;
}

static void cost(const char *name, sw_result_t (*call)(void), uint32_t limit)
{
    uint32_t measured = instructions(call);
    print("cost: ");
    say(name, measured, " instructions of ", limit);
}

/* At most so many more than the crates need. */
static void more(const char *name, sw_result_t (*call)(void), sw_result_t (*rust)(void), uint32_t limit)
{
    uint32_t ours = instructions(call), theirs = instructions(rust);
    print("cost: ");
    print(name);
    print(": C ");
    print_number(ours);
    print(", Rust ");
    print_number(theirs);
    say(", more", ours > theirs ? ours - theirs : 0, " of ", limit);
}

int main(void)
{
    SYST_RVR = 0xffffffu;
    SYST_CVR = 0;
    SYST_CSR = 5;
    (void)sw_tformat_init(&m, 2500000, 23, 16);
    rust_ask_all = rust_start(&rust_m);
    (void)sw_aformat_bus_start_abs40(&bus, 0x08);
    rust_bus_start(&rust_bus, 0x08);
    (void)sw_rtex_axis_start(&axis, &config);
    rust_rtex_start(&rust_axis);
    (void)sw_hdsl_start(&dsl, SW_HDSL_SICK, 0);
    rust_hdsl_start(&rust_dsl);
    (void)sw_clock_start(&clk, 170000000, 0);
    /* Typed: 10 more. Generic: 50. A call of a state machine: 40; of T-Format, which begins in place and pushes, 15, so the two calls of an
     * exchange 30. */
    more("T-Format ID 3, typed", parse_all, parse_all_rust, 10);
    more("T-Format ID 0, typed", parse_single, parse_single_rust, 10);
    more("T-Format ID 3, generic", parse_any, parse_any_rust, 50);
    more("T-Format exchange of two calls", exchange, exchange_rust, 30);
    more("T-Format poll", poll, poll_rust, 15);
    more("T-Format angle", judged, judged_rust, 15);
    more("A-format position of a bus", push, push_rust, 40);
    more("RTEX response, generic", parse_block, parse_block_rust, 50);
    more("RTEX axis hears", hear_block, hear_block_rust, 40);
    more("RTEX axis sends", transmit, transmit_rust, 40);
    more("RTEX feedback", fed_back, fed_back_rust, 40);
    more("HDSL H-frame of the start-up", hear_bits, hear_bits_rust, 40);
    more("SORTE device frame, typed", parse_device, parse_device_rust, 10);
    more("next step", next, next_rust, 10);
    cost("typed parse of ID 3", parse_all, 58);
    cost("typed parse of ID 0", parse_single, 46);
    cost("generic parse of ID 3", parse_any, 126);
    cost("exchange: read and hear", exchange, 540);
    cost("angle, judged", judged, 64);
    cost("clock", clock_ns, 34);
    return worst | (all_data.abs != 3915817) | (single_data.abs != 1883572) | (position.abs != 1201024) | (frame.status != 4) |
           (drive.response_data1 != 1000) | (step.sync != 1234) | (sink < 0);
}
