/* A master that reads, and the angle. */
#include "servowire.h"
int main(void);
static volatile uint8_t heard[11];
static sw_tformat_t m;
static sw_tformat_transmission_t tx;
static uint32_t angle;
int main(void)
{
    (void)sw_tformat_init(&m, 2500000, 23, 16);
    (void)sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 0, &tx);
    (void)sw_tformat_hear(&m, (const uint8_t *)heard, 11, 51000);
    (void)sw_tformat_poll(&m, 60000);
    return sw_tformat_angle(&m, 60000, 100000, &angle);
}
