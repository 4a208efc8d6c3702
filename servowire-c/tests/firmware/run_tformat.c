/* Runs examples/tformat_uart.c against the modelled encoder: 3000 cycles of a turning shaft, with answers damaged, late, and none at
 * all. What the loop commutates by has to be where the shaft was, and the outputs have to go off when nothing young is known. */
#include "../../examples/hal.h"
#include "servowire.h"
#include "start.h"

static sw_tformat_device_t encoder;
static uint64_t now_ns = 0xfff00000u * 10ull; /* 10 ns a cycle; the counter wraps after some cycles of the loop */
static uint64_t idle_at_ns;                   /* when the idle interrupt comes; 0 for none */
static sw_tformat_answer_t answer;
static uint8_t *buffer;
static uint32_t field, shaft;
static int driven, damage, unplugged;

uint32_t hal_cycles(void) { return (uint32_t)(now_ns / 10); }
void hal_pwm_off(void) { driven = 0; }
void hal_uart_receive_to_idle_dma(uint8_t *bytes, uint16_t size) { buffer = size >= 11 ? bytes : 0; }

void hal_pwm_set_field(uint32_t angle)
{
    driven = 1;
    field = angle;
}

void hal_uart_transmit_dma(const uint8_t *bytes, uint16_t len)
{
    uint64_t end_ns = now_ns + len * 4000u;
    if (!unplugged && sw_tformat_device_hear(&encoder, bytes, len, end_ns, &answer) == SW_SEND) {
        idle_at_ns = answer.end_ns + 4000;
    }
}

static void receive(void)
{
    uint8_t k;
    for (k = 0; k < answer.len; k++) {
        buffer[k] = answer.bytes[k];
    }
    buffer[4] = (uint8_t)(buffer[4] ^ damage);
    now_ns = idle_at_ns;
    idle_at_ns = 0;
    example_received(answer.len);
}

int main(void)
{
    uint32_t cycle, on = 0, off = 0;
    if (sw_tformat_device_start(&encoder, 0x17, 2500000) != SW_OK) {
        return 2;
    }
    example_init();
    for (cycle = 0; cycle < 3000; cycle++) {
        uint64_t begin_ns = now_ns;
        uint32_t before = shaft;
        damage = cycle >= 1000 && cycle < 1010;
        unplugged = cycle >= 2000 && cycle < 2020;
        shaft = (shaft + 1677) & 0x7fffff; /* 120 turns a minute */
        (void)sw_tformat_device_set_position(&encoder, shaft, 0);
        example_control();
        /* Five cycles after the last good answer the age is beyond its limit, and never before the third. */
        if (driven) {
            on++;
            if (!damage && !unplugged && cycle > 4 && cycle % 1000 > 40 && field != (before << 9) * 4) {
                print("another angle than that of the shaft\n");
                return 1;
            }
        } else {
            off++;
        }
        if ((cycle == 1005 || cycle == 2005) && driven) {
            print("the outputs are on, and nothing is known\n");
            return 1;
        }
        if ((cycle == 999 || cycle == 1999 || cycle == 2999) && !driven) {
            print("the outputs are off, and all is well\n");
            return 1;
        }
        if (idle_at_ns != 0) {
            receive();
        }
        now_ns = begin_ns + 100000;
    }
    print("tformat_uart: on ");
    print_number(on);
    print(", off ");
    print_number(off);
    print("\n");
    return on > 2900 && off > 10 ? 0 : 1;
}
