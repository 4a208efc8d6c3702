/* The generic call, with its detail. */
#include "servowire.h"
int main(void);
static volatile uint8_t heard[11];
static const sw_tformat_request_t asked = {SW_TFORMAT_READ_ALL, 0, 0};
static sw_tformat_response_t data;
static sw_detail_t why;
int main(void)
{
    return sw_tformat_parse(&asked, (const uint8_t *)heard, 11, &data) + sw_tformat_why(&asked, (const uint8_t *)heard, 11, &why);
}
