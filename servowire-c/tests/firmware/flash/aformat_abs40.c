/* The positions of a bus, as words. */
#include "servowire.h"
int main(void);
static volatile uint16_t heard[4];
static sw_aformat_bus_t bus;
static sw_aformat_abs40_t data;
int main(void)
{
    (void)sw_aformat_bus_start_abs40(&bus, 3);
    (void)sw_aformat_bus_push_abs40(&bus, (const uint16_t *)heard, 4, SW_MSB_FIRST, &data);
    return sw_aformat_bus_missing(&bus);
}
