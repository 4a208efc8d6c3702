/* Instructions of a call, of a Cortex-M4: with `-icount shift=0` an instruction takes 1 ns, and a tick of the SysTick of this board 40. The
 * empty call is subtracted. */
#include "servowire.h"
#include "start.h"

#define SYST_CSR (*(volatile uint32_t *)0xe000e010u)
#define SYST_RVR (*(volatile uint32_t *)0xe000e014u)
#define SYST_CVR (*(volatile uint32_t *)0xe000e018u)

/* ID 3 and ID 0, published answers. */
static const uint8_t all[11] = {0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0x00, 0xdf};
static const uint8_t single[6] = {0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37};
static const sw_tformat_request_t ask_all = {SW_TFORMAT_READ_ALL, 0, 0};
static sw_tformat_all_t all_data;
static sw_tformat_single_turn_t single_data;
static sw_tformat_response_t response;
static sw_tformat_t m;
static sw_tformat_transmission_t tx;
static sw_clock_t clk;
static uint32_t angle, ticks_now;
static uint64_t begin_ns;
static volatile sw_result_t sink;

static sw_result_t empty(void)
{
    __asm__ volatile("");
    return 0;
}
static sw_result_t parse_all(void) { return sw_tformat_parse_all(all, 11, &all_data); }
static sw_result_t parse_single(void) { return sw_tformat_parse_single_turn(single, 6, &single_data); }
static sw_result_t parse_any(void) { return sw_tformat_parse(&ask_all, all, 11, &response); }
static sw_result_t exchange(void)
{
    begin_ns += 100000;
    (void)sw_tformat_read(&m, SW_TFORMAT_READ_ALL, begin_ns, &tx);
    return sw_tformat_hear(&m, all, 11, begin_ns + 51000);
}
static sw_result_t judged(void) { return sw_tformat_angle(&m, begin_ns + 60000, 100000, &angle) ? 0 : -1; }
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

static int worst;

static void cost(const char *name, sw_result_t (*call)(void), uint32_t limit)
{
    uint32_t instructions = (ticks(call) - ticks(empty) + 50) / 100;
    print("cost: ");
    print(name);
    print(" ");
    print_number(instructions);
    print(" instructions of ");
    print_number(limit);
    print(instructions > limit ? " TOO MANY\n" : "\n");
    worst |= instructions > limit;
}

int main(void)
{
    SYST_RVR = 0xffffffu;
    SYST_CVR = 0;
    SYST_CSR = 5;
    (void)sw_tformat_init(&m, 2500000, 23, 16);
    (void)sw_clock_start(&clk, 170000000, 0);
    cost("typed parse of ID 3", parse_all, 58);
    cost("typed parse of ID 0", parse_single, 46);
    cost("generic parse of ID 3", parse_any, 126);
    cost("exchange: read and hear", exchange, 540);
    cost("angle, judged", judged, 64);
    cost("clock", clock_ns, 34);
    return worst | (all_data.abs != 3915817) | (single_data.abs != 1883572) | (sink < 0);
}
