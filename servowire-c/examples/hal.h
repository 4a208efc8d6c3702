/* What the examples take from the firmware around them: names in the manner of vendors' HALs. Yours has its own. */
#ifndef HAL_H
#define HAL_H

#include <stdint.h>

void hal_uart_transmit_dma(const uint8_t *bytes, uint16_t len); /* the driver of the line goes on and off by itself */
void hal_uart_receive_to_idle_dma(uint8_t *bytes, uint16_t size);
uint32_t hal_cycles(void);              /* free-running, 32 bits */
void hal_pwm_set_field(uint32_t angle); /* electrical angle, a turn is 2^32 */
void hal_pwm_off(void);

/* What the examples give it. */
void example_init(void);
void example_control(void);        /* 10 kHz */
void example_received(uint16_t n); /* the line has been idle for a character, or the buffer is full */

#endif
