/* T-Format at a UART with DMA and idle-line interrupt, read in a 10-kHz control loop, all at one priority. */
#include "hal.h"
#include "servowire.h"

enum { POLE_PAIRS = 4, CPU_HZ = 100000000, MAX_AGE_NS = 250000 }; /* two cycles and a half */

static sw_clock_t clk;
static sw_tformat_t encoder;
static uint8_t buffer[16];

void example_init(void)
{
    sw_tformat_line_t line;
    (void)sw_clock_start(&clk, CPU_HZ, hal_cycles());
    (void)sw_tformat_init(&encoder, 2500000, 23, 16);
    (void)sw_tformat_get_line(&encoder, &line);
    line.hand_over_ns = 20000; /* an idle character and the interrupt */
    (void)sw_tformat_set_line(&encoder, &line);
    hal_uart_receive_to_idle_dma(buffer, sizeof buffer);
}

void example_control(void)
{
    uint64_t now = sw_clock_ns(&clk, hal_cycles());
    sw_tformat_transmission_t tx;
    uint32_t angle;

    (void)sw_tformat_poll(&encoder, now);
    if (sw_tformat_angle(&encoder, now, MAX_AGE_NS, &angle)) {
        hal_pwm_set_field(angle * POLE_PAIRS);
    } else {
        hal_pwm_off();
    }
    if (sw_tformat_read(&encoder, SW_TFORMAT_READ_ALL, now, &tx) == SW_SEND) { /* refused while the line is not free */
        hal_uart_transmit_dma(tx.bytes, tx.len);
    }
}

void example_received(uint16_t n)
{
    (void)sw_tformat_hear(&encoder, buffer, n, sw_clock_ns(&clk, hal_cycles()) - 4000); /* the idle character */
    hal_uart_receive_to_idle_dma(buffer, sizeof buffer);
}
