/* The words of a bus of ABS40 encoders. */
#include "servowire.h"
int main(void);
static volatile uint16_t heard[4];
static const sw_aformat_encoder_t encoder = {20, 16, 0};
static const sw_aformat_request_t asked = {0, 4, 0, 0, 0, 0};
static sw_aformat_bus_t bus;
static sw_aformat_response_t response;
int main(void)
{
    (void)sw_aformat_bus_start(&bus, &asked, &encoder, 3);
    (void)sw_aformat_bus_push(&bus, (const uint16_t *)heard, 4, SW_MSB_FIRST, &response);
    return sw_aformat_bus_missing(&bus);
}
