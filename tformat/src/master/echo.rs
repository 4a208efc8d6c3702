use crate::error::Error;
use crate::request::Request;
use crate::response::Response;

/// Decodes everything that a UART received since the request began, with the receiver always on: the master's own request, then
/// the response. It is for buffers without times; bytes after the response are ignored.
///
/// # Errors
/// [`Error::NoResponse`] without any byte; [`Error::EchoMismatch`] for the first byte that is not what was sent;
/// [`Error::Truncated`] in the middle of the echo; [`Error::NoResponse`] with `echo` set if nothing follows it: no encoder is
/// there, or the wires A and B are swapped; then as [`Response::parse`].
pub fn parse_echoed(request: Request, bytes: &[u8]) -> Result<Response, Error> {
    let sent = request.emit();
    for (at, (&want, &got)) in (0..).zip(sent.as_bytes().iter().zip(bytes)) {
        if got != want {
            return Err(Error::EchoMismatch { at, got, want });
        }
    }
    match (bytes, bytes.get(usize::from(sent.fields())..)) {
        ([], _) => Err(Error::NoResponse { echo: false }),
        (_, None) => Err(Error::Truncated { got: 0, want: request.data_id().response_fields().into() }),
        (_, Some([])) => Err(Error::NoResponse { echo: true }),
        (_, Some(response)) => Response::parse(request, response),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::address::Address;

    /// A buffer without times: the request of four bytes as it came back, and after it a response or nothing.
    #[test]
    fn what_a_uart_received_since_the_request_began() {
        let request = Request::write_eeprom(Address::truncate(1), 0x5a);
        let echo = [0x32, 0x01, 0x5a, 0x69];
        // The response to a write repeats it, so it looks the same.
        let both = [&echo[..], &echo[..], &[0xff]].concat();
        assert_eq!(parse_echoed(request, &both), Response::parse(request, &echo));
        assert!(parse_echoed(request, &both).is_ok());
        assert_eq!(parse_echoed(request, &[]), Err(Error::NoResponse { echo: false }));
        assert_eq!(parse_echoed(request, &echo), Err(Error::NoResponse { echo: true }));
        for got in 1..4 {
            assert_eq!(parse_echoed(request, &echo[..got]), Err(Error::Truncated { got: 0, want: 4 }));
            let mut wrong = both.clone();
            wrong[got] ^= 4;
            let want = echo[got];
            assert_eq!(parse_echoed(request, &wrong), Err(Error::EchoMismatch { at: got as u8, got: want ^ 4, want }));
        }
    }
}
