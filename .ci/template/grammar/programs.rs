use @snake@::Frame;

decode! { @snake@::Frame(&[u8]); with (); sound &[0x5a, 0x01, 0x89]; damaged &[0x5a, 0x01, 0x88] => "crc" }
encode! { @snake@::Frame = Frame { value: 1 } }
differs! {
    CODE: "not yet";
    EXCHANGE: "not yet";
    PROCEDURE: "not yet";
    FEEDBACK: "not yet";
    DEVICE: "not yet";
    INSPECT: "not yet";
    LOG: "not yet";
    COUNTERS: "not yet";
}
