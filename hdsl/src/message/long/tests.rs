use super::*;
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;

fn data() -> impl Strategy<Value = Data> {
    (0..4_u8, any::<[u8; 8]>())
        .prop_map(|(code, bytes)| Data::new(&bytes[..Length::ALL[usize::from(code)].bytes()]).unwrap())
}

pub(crate) fn requests() -> impl Strategy<Value = LongRequest> {
    let access = prop_oneof![
        (0..4_u8).prop_map(|code| Access::Read(Length::ALL[usize::from(code)])),
        data().prop_map(Access::Write),
    ];
    (0..1024_u16, any::<bool>(), prop::option::of(0..1_u16 << 15), access).prop_map(
        |(address, indirect, offset, access)| LongRequest {
            address: ResourceAddress::truncate(address),
            indirect,
            offset: offset.map(Offset::truncate),
            access,
        },
    )
}

proptest! {
    #[test]
    fn requests_come_back(request in requests()) {
        let bytes = request.emit();
        prop_assert_eq!(LongRequest::parse(bytes.as_bytes()), Ok(request));
        prop_assert_eq!(bytes.as_bytes().len(), request_len(bytes.as_bytes()[0]));
        for len in 0..bytes.as_bytes().len() {
            let cut = matches!(LongRequest::parse(&bytes.as_bytes()[..len]), Err(Error::Truncated { .. }));
            prop_assert!(cut);
        }
    }

    #[test]
    fn answers_come_back(request in requests(), data: [u8; 8], code in prop::option::of(any::<[u8; 2]>())) {
        let data = match request.access {
            Access::Read(length) => Data::new(&data[..length.bytes()]).unwrap(),
            Access::Write(_) => Data::NONE,
        };
        let result = match code {
            Some([class, detail]) => Err(ResourceError::new(class, detail)),
            None => Ok(data),
        };
        let answer = LongAnswer::to(&request, result);
        let bytes = answer.emit();
        let want = match result {
            Err(error) => Err(Error::Resource { error }),
            Ok(data) => Ok(if request.is_read() { data } else { Data::NONE }),
        };
        prop_assert_eq!(request.parse_answer(bytes.as_bytes()), want);
        let good: Vec<u8> = bytes.as_bytes().to_vec();
        for bit in 0..good.len() * 8 {
            let mut bad = good.clone();
            bad[bit / 8] ^= 0x80 >> (bit % 8);
            let Err(error) = request.parse_answer(&bad) else {
                // A refused write without its LOFF is the answer to a done one if its error code is that answer's CRC.
                let check = crate::crc::crc16(&bad[..2]).to_be_bytes();
                prop_assert!(bit == 2 && matches!(request.access, Access::Write(_)) && bad[2..4] == check);
                continue;
            };
            match bit {
                0 => prop_assert_eq!(error, Error::ShortMessageStart { first: bad[0] }),
                // Direction, error flag and length decide how long the message is; of 65,536 shorter ones one has a right CRC.
                1 | 2 | 4 | 5 => {
                    let seen = matches!(error, Error::Crc { .. } | Error::Truncated { .. } | Error::Header { .. });
                    prop_assert!(seen || matches!(error, Error::DataLength { .. }), "{}", error);
                }
                _ => {
                    let crc = matches!(error, Error::Crc { .. });
                    prop_assert!(crc, "{} {}", bit, error);
                }
            }
        }
    }

    #[test]
    fn accepted_requests_are_what_it_would_emit(bytes in prop::collection::vec(any::<u8>(), 2..12)) {
        let mut bytes = bytes;
        bytes[0] |= MARK;
        let crc = crate::crc::crc16(&bytes);
        bytes.extend(crc.to_be_bytes());
        if let Ok(request) = LongRequest::parse(&bytes) {
            let emitted = request.emit();
            prop_assert_eq!(emitted.as_bytes(), &bytes[..emitted.as_bytes().len()]);
        }
    }
}

#[test]
fn the_documented_examples() {
    let request = LongRequest {
        address: ResourceAddress::RESOLUTN,
        indirect: false,
        offset: Offset::new(3),
        access: Access::Read(Length::Two),
    };
    assert_eq!(request.emit().as_bytes(), [0xe4, 0x81, 0x80, 0x03, 0x14, 0x13]);
    let refused = LongRequest { address: ResourceAddress::truncate(0x200), offset: None, ..request };
    let answer = [0xe6, 0x00, 0x10, 0x40, 0x38, 0x7b];
    assert_eq!(refused.parse_answer(&answer), Err(Error::Resource { error: ResourceError::NOT_THERE }));
    assert!(matches!(request.parse_answer(&answer), Err(Error::Header { .. })));
    assert_eq!(request.to_string(), "direct read of 081h RESOLUTN, 2 bytes, offset 3");
    let answer = LongAnswer::to(&refused, Err(ResourceError::NOT_THERE));
    assert_eq!(answer.to_string(), "200h ACCESSIO refused: the resource is not there (class 40h, detail 10h)");
    let write =
        LongRequest { access: Access::Write(Data::new(b"MO").unwrap()), indirect: true, offset: None, ..request };
    assert_eq!(write.to_string(), "indirect write to 081h RESOLUTN: 4D 4F");
    assert_eq!(Data::new(&[0; 3]), Err(Error::DataLength { len: 3 }));
}

/// A wrong bit of LLEN makes an answer of eight bytes one of two, and what follows these is by chance their CRC: that is not what
/// was asked for.
#[test]
fn a_shorter_answer_with_a_right_check() {
    let request = LongRequest::read(ResourceAddress::RWFILE, Length::Eight);
    let [first, second] = request.header();
    let short = first ^ 0x08;
    let [high, low] = crate::crc::crc16(&[short, second, 1, 2]).to_be_bytes();
    let mut answer =
        LongAnswer::to(&request, Ok(Data::eight([1, 2, high, low, 5, 6, 7, 8]))).emit().as_bytes().to_vec();
    assert!(request.parse_answer(&answer).is_ok());
    answer[0] = short;
    assert!(matches!(request.parse_answer(&answer), Err(Error::Header { .. })));
    // The same of an error code.
    let refused = LongAnswer::to(&request, Err(ResourceError::NOT_THERE)).header();
    let [high, low] = crate::crc::crc16(&[refused[0] ^ 0x04, refused[1]]).to_be_bytes();
    let answer = [refused[0] ^ 0x04, refused[1], high, low];
    assert_eq!(request.parse_answer(&answer), Err(Error::DataLength { len: 0 }));
}

/// The CRC does not cover the length: one wrong bit, LOFF, makes a refused write a done one if its error code is that answer's CRC.
#[test]
fn one_error_code_of_65_536_is_the_check_of_success() {
    let data = Data::new(&[1, 2]).unwrap();
    let request =
        LongRequest { access: Access::Write(data), ..LongRequest::read(ResourceAddress::RWFILE, Length::Two) };
    // An acknowledgement has no data, whatever LLEN says: here it still says two, as for an error code.
    let [refused, second] = LongAnswer::to(&request, Err(ResourceError::NOT_THERE)).header();
    let first = refused & !0x20;
    let [detail, class] = crate::crc::crc16(&[first, second]).to_be_bytes();
    let answer = LongAnswer::to(&request, Err(ResourceError::new(class, detail)));
    let mut bytes = answer.emit().as_bytes().to_vec();
    assert!(matches!(request.parse_answer(&bytes), Err(Error::Resource { .. })));
    assert_eq!(bytes[0], refused);
    bytes[0] = first;
    assert_eq!(request.parse_answer(&bytes), Ok(Data::NONE));
}
