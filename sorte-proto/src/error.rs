use crate::frame_type::FrameType;

servowire_core::errors! {
    /// Why bytes, a number or an event were refused.
    ///
    /// The checks are made in the order given with each parser; the first that fails is reported. A refusal leaves
    /// every state machine as it was.
    pub enum Error {
        /// There are fewer bytes than the frame has.
        #[error("frame of {got} bytes, {want} are needed")]
        Truncated = 1 {
            /// Bytes given.
            got: u16,
            /// Number of bytes in a frame of this kind; 8 if the kind is not known.
            want: u16,
        },
        /// The frame check sequence does not match the bytes before it.
        #[error("FCS is {got:#010x}, the bytes before it give {want:#010x}")]
        BadFcs = 2 {
            /// FCS in the frame.
            got: u32,
            /// FCS computed.
            want: u32,
        },
        /// DA of a long-header frame is not 255.
        #[error("destination address {got}, only 255 (all) is in use")]
        WrongDestination = 3 {
            /// DA in the frame.
            got: u8,
        },
        /// TYPE is not one of 1 to 10.
        #[error("frame type {got} is not known")]
        UnknownType = 4 {
            /// TYPE in the frame.
            got: u8,
        },
        /// TYPE is known, but not the requested one.
        #[error("frame type {got} instead of {want}")]
        UnexpectedType = 5 {
            /// TYPE in the frame.
            got: u8,
            /// TYPE requested.
            want: u8,
        },
        /// There are more bytes than a frame of this kind has.
        #[error("frame of {got} bytes, its kind has {want}")]
        TooLong = 6 {
            /// Bytes given.
            got: u16,
            /// Number of bytes in a frame of this kind.
            want: u16,
        },
        /// The CRC-8 of an IO-exchange frame does not match.
        #[error("CRC-8 is {got:#04x}, the bytes before it give {want:#04x}")]
        BadCrc8 = 7 {
            /// CRC-8 in the frame.
            got: u8,
            /// CRC-8 computed.
            want: u8,
        },
        /// SA is not 0 in a master frame, or not 1 to 254 in a device frame.
        #[error("source address {got} does not belong to this kind of frame")]
        WrongSource = 8 {
            /// SA in the frame.
            got: u8,
        },
        /// The preamble is not 1 to 7 bytes 0x55 followed by 0xD5.
        #[error("preamble is wrong at byte {at}")]
        BadPreamble = 9 {
            /// Index of the first byte that does not fit.
            at: u8,
        },
        /// The network has more than 254 devices.
        #[error("device count {count}, 254 is the maximum")]
        TooManyDevices = 10 {
            /// Count in the frame.
            count: u16,
        },
        /// The totals of a discovery frame are not the sums of its entries.
        #[error("total of {got} bytes, the entries sum to {want}")]
        TableMismatch = 11 {
            /// Total in the frame.
            got: u16,
            /// Sum of the entries, saturated.
            want: u16,
        },
        /// A slice of process data lies outside the output bytes.
        #[error("bytes {offset}..{offset}+{len} are not among the output bytes")]
        OutsideOutput = 12 {
            /// First byte of the slice.
            offset: u16,
            /// Its length.
            len: u16,
        },
        /// The number of output bytes passed for a master frame is not that of the line.
        #[error("{got} output bytes were given, the line has {want}")]
        OutputLength = 13 {
            /// Bytes given.
            got: u16,
            /// Number of output bytes of the line.
            want: u16,
        },
        /// The buffer to write a frame into is too small.
        #[error("buffer of {got} bytes, {want} are needed")]
        BufferTooSmall = 14 {
            /// Number of bytes in the buffer.
            got: u16,
            /// Number of bytes in the frame.
            want: u16,
        },
        /// The PTO word is undefined: between 3991 and 0x7FFE, with or without bit 15, or 0xFFFF.
        #[error("PTO word {raw:#06x} has no meaning")]
        ReservedPtoValue = 15 {
            /// The word.
            raw: u16,
        },
        /// A round trip is shorter than the forwarding time, or too long for the 16-bit sum.
        #[error("round trip of {rtt_ns} ns is impossible")]
        ImplausibleRoundTrip = 16 {
            /// The round trip, or the mean of 16.
            rtt_ns: u32,
        },
        /// The time stamp of an IO-exchange frame lies outside the window.
        #[error("time stamp {got} is not within the window around {want}")]
        ImplausibleTimeStamp = 17 {
            /// Time stamp in the frame.
            got: u16,
            /// Time stamp expected.
            want: u16,
        },
        /// A start-up frame was not answered in time.
        #[error("no answer to {sent} frame {frame}")]
        NoAnswer = 20 {
            /// TYPE of the frame sent.
            sent: FrameType,
            /// Its number in this phase, from 0.
            frame: u16,
        },
        /// A start-up frame began before the request that it would answer: it is an answer to an earlier one.
        #[error("the frame began {early_ns} ns before the request")]
        BeforeRequest = 21 {
            /// How much earlier, in ns.
            early_ns: u32,
        },
        /// DISCOVERY found fewer devices than required.
        #[error("{got} devices answered, {want} are needed")]
        TooFewDevices = 22 {
            /// Number of devices in the line.
            got: u8,
            /// Number of devices required.
            want: u8,
        },
        /// Device frames were missing in too many consecutive cycles.
        #[error("no frame of device {first} for {cycles} cycles, {count} missing in all")]
        DevicesMissing = 23 {
            /// Address of the first that is missing.
            first: u8,
            /// How many device frames are missing.
            count: u8,
            /// Number of consecutive cycles in which they were missing.
            cycles: u8,
        },
        /// Device frames were damaged in too many consecutive cycles.
        #[error("damaged device frames in {cycles} consecutive cycles")]
        TooManyCrcErrors = 24 {
            /// Number of consecutive cycles in which they were missing.
            cycles: u8,
        },
        /// A device frame has an address beyond the end of the line, or LAST is set or missing at a device where that was
        /// not so before.
        #[error("the line has changed: device {address} does not fit what DISCOVERY found")]
        TopologyChanged = 25 {
            /// Address of the sender.
            address: u8,
        },
        /// The last device is further away than the 16-bit delay in SYNC can express.
        #[error("the last device is {delay_ns} ns away, the delay field of SYNC ends at 65535 ns")]
        LineTooLong = 26 {
            /// Its delay from the master.
            delay_ns: u32,
        },
        /// The cycle is too short for the line.
        #[error("the cycle is too short from device {device} on, which needs {needs_ns} ns")]
        CycleTooShort = 27 {
            /// Address of the first device that does not fit.
            device: u8,
            /// The cycle that it would need.
            needs_ns: u32,
        },
        /// The link of the master is down.
        #[error("the link is down")]
        LinkDown = 28,
        /// The frame does not fit the present state.
        #[error("the frame does not belong to the present state")]
        WrongState = 29,
        /// A `nom` combinator of the caller refused the input.
        #[error("a parser combinator refused the input")]
        Combinator = 30,
        /// The frame of a device comes too close to the one before it, given the jitter of the ports that both pass.
        #[error("the frame of device {device} comes {gap_ns} ns after the one before it, {needs_ns} ns are needed")]
        GapTooShort = 31 {
            /// Whose frame.
            device: u8,
            /// Gap after the previous frame, at the master; negative if they overlap.
            gap_ns: i32,
            /// Gap needed for six sigma of jitter.
            needs_ns: u32,
        },
        /// A device would have to send before its cycle begins: its cable is longer than a slot.
        #[error("device {device} would have to send {early_ns} ns before the cycle")]
        SendBeforeCycle = 32 {
            /// Which.
            device: u8,
            /// How long before, in ns.
            early_ns: u32,
        },
        /// A frame of the IO exchange began at a time that does not belong to its sender.
        #[error("the frame began {off_ns} ns away from its time")]
        OutsideWindow = 33 {
            /// Distance from the nearest time at which it was expected, in ns.
            off_ns: i32,
        },
        /// A frame from this sender has already come in this cycle.
        #[error("a second frame of {address} in one cycle")]
        Doubled = 34 {
            /// Address of the sender; 0 for the master.
            address: u8,
        },
        /// A frame of the IO exchange belongs to a cycle that has ended.
        #[error("the frame belongs to a cycle that is over")]
        CycleOver = 35,
        /// The last SYNC frame has gained less time than the devices of the line add to it: one of them has let it pass
        /// unchanged, because it could not measure its cable or has started again. The clocks of that device and of those
        /// behind it are wrong.
        #[error("SYNC has passed {got} devices at most, DISCOVERY found {want}")]
        NotInSync = 36 {
            /// The largest number of devices that can have added their time.
            got: u8,
            /// Number of devices that DISCOVERY found.
            want: u8,
        },
    }
}

servowire_core::nom_error!(Error);
