/* A bus of ABS40 encoders, and an angle. */
#include "servowire.h"
int main(void);
static volatile uint16_t heard[8];
static const sw_aformat_encoder_t encoder = {20, 16, 0};
static sw_aformat_t m;
static sw_aformat_transmission_t tx;
static uint32_t angle;
int main(void)
{
    (void)sw_aformat_init(&m, 4000000, &encoder);
    (void)sw_aformat_read(&m, 4, 3, 0, &tx);
    (void)sw_aformat_hear(&m, (const uint16_t *)heard, 0, 8, 51000);
    (void)sw_aformat_poll(&m, 60000);
    return sw_aformat_angle(&m, 0, 60000, 100000, &angle);
}
