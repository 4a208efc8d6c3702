/* One typed call. */
#include "servowire.h"
int main(void);
static volatile uint8_t heard[11];
static sw_tformat_all_t data;
int main(void) { return sw_tformat_parse_all((const uint8_t *)heard, 11, &data); }
