//! The addresses of the registers.

servowire_core::codes! {
    /// Address of a register of one byte, or of the first of several.
    pub enum Register: u8 {
        /// SYS_CTRL: bit 7 PRST (protocol reset), bit 6 MRST (message reset); both are cleared when done.
        SysCtrl = 0x00 => "SYS_CTRL",
        /// SYNC_CTRL: ES; 0 for free running.
        SyncCtrl = 0x01 => "SYNC_CTRL",
        /// MASTER_QM: bit 7 LINK, bits 3:0 quality monitor.
        MasterQm = 0x03 => "MASTER_QM",
        /// EVENT_H, see [`Event`](super::Event).
        EventH = 0x04 => "EVENT_H",
        /// EVENT_L, see [`Event`](super::Event).
        EventL = 0x05 => "EVENT_L",
        /// MASK_H: which events raise an interrupt. According to the manual, bit 6 MSUM is set if any bit of MASK_SUM is set.
        MaskH = 0x06 => "MASK_H",
        /// MASK_L.
        MaskL = 0x07 => "MASK_L",
        /// MASK_SUM: which bits of SUMMARY raise the event SUM.
        MaskSum = 0x08 => "MASK_SUM",
        /// EDGES: bit n is set when an edge of the test pattern was seen in sample period n of the start-up. Not filled by the
        /// SDK.
        Edges = 0x09 => "EDGES",
        /// DELAY: bits 7:4 RSSI, bits 3:0 cable delay in bits.
        Delay = 0x0a => "DELAY",
        /// VERSION: 10h here and in the SDK.
        Version = 0x0b => "VERSION",
        /// RELEASE: 1 here and in the SDK.
        Release = 0x0c => "RELEASE",
        /// ENC_ID2..ENC_ID0; ENC_ID2 holds its nibble twice.
        EncId = 0x0d => "ENC_ID",
        /// POS4..POS0: fast position.
        Pos = 0x10 => "POS",
        /// VEL2..VEL0: speed in steps per H-frame.
        Vel = 0x15 => "VEL",
        /// VPOS4..VPOS0: safe position 1.
        VPos = 0x19 => "VPOS",
        /// VPOSCRC_H, VPOSCRC_L: as received.
        VPosCrc = 0x1e => "VPOSCRC",
        /// PC_BUFFER0..7: data of long messages.
        PcBuffer = 0x20 => "PC_BUFFER",
        /// PC_ADD_H, PC_ADD_L: header of a long message; bit 5 of PC_ADD_H in an answer marks an error.
        PcAdd = 0x28 => "PC_ADD",
        /// PC_OFF_H, PC_OFF_L: offset; not used if the request has none.
        PcOff = 0x2a => "PC_OFF",
        /// PC_CTRL: bit 0 LSTA starts a long message.
        PcCtrl = 0x2c => "PC_CTRL",
        /// PIPE_S: status of the pipe FIFO; reading it takes out the oldest entry. Not in the SDK.
        PipeS = 0x2d => "PIPE_S",
        /// PIPE_D: the entry that was taken out; in the SDK the last byte of the pipe channel.
        PipeD = 0x2e => "PIPE_D",
        /// PC_DATA: data of short messages at the drive interface of the SICK core; S_PC_DATA is the one at its safe
        /// interface. Not in the SDK.
        PcData = 0x2f => "PC_DATA",
        /// SAFE_CTRL: like SYS_CTRL.
        SafeCtrl = 0x35 => "SAFE_CTRL",
        /// SAFE_SUM: SUMMARY of the last V-frame, of the last good one in the SICK core.
        SafeSum = 0x36 => "SAFE_SUM",
        /// S_PC_DATA: data of short messages.
        SPcData = 0x37 => "S_PC_DATA",
        /// ACC_ERR_CNT: number of acceleration words in a row that could not be used; stops at 31 in the SICK core.
        AccErrCnt = 0x38 => "ACC_ERR_CNT",
        /// MAXACC: limit of the estimator's acceleration, initially FFh. Stored here; not in the SDK.
        MaxAcc = 0x39 => "MAXACC",
        /// MAXDEV_H, MAXDEV_L: largest deviation while estimating, initially FFFFh. Stored here; not in the SDK.
        MaxDev = 0x3a => "MAXDEV",
        /// EVENT_S, see [`EventS`](super::EventS).
        EventS = 0x3d => "EVENT_S",
        /// MASK_S: which safe events raise an interrupt.
        MaskS = 0x3e => "MASK_S",
        /// SLAVE_REG_CTRL: bit 7 read, bits 5:0 register of the encoder minus 40h; writing starts a short message. 3Fh when
        /// idle. In the SICK core the registers of the encoder are at 40h..7Fh of this map.
        SlaveRegCtrl = 0x40 => "SLAVE_REG_CTRL",
        /// ACC_ERR_CNT_THRESH: restart threshold, initially 1Fh.
        AccErrCntThresh = 0x41 => "ACC_ERR_CNT_THRESH",
        /// VERSION2.
        Version2 = 0x44 => "VERSION2",
        /// STATUS2: bit 7 TOG2, 6 TEST2, 5 ERR2, 4:0 FIX2 = 11100b.
        Status2 = 0x46 => "STATUS2",
        /// VPOS24..VPOS20: safe position 2.
        VPos2 = 0x47 => "VPOS2",
        /// VPOSCRC2_H, VPOSCRC2_L.
        VPosCrc2 = 0x4c => "VPOSCRC2",
        /// POSTX: 0 request sent, 2 fast position ready, 3 safe positions ready.
        PosTx = 0x4e => "POSTX",
        /// ONLINE_STATUS_D_H, see [`OnlineD`](super::OnlineD).
        OnlineStatusD = 0x50 => "ONLINE_STATUS_D",
        /// ONLINE_STATUS_1_H, see [`Online1`](super::Online1).
        OnlineStatus1 = 0x52 => "ONLINE_STATUS_1",
        /// ONLINE_STATUS_2_H, see [`Online2`](super::Online2).
        OnlineStatus2 = 0x54 => "ONLINE_STATUS_2",
    }
}
