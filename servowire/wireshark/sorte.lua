-- Wireshark dissector for TI SORTE (Simple Open Real-Time Ethernet).
--
-- Start-up frames (DISCOVERY, PARAM, DELAY_REQ, SYNC) are Ethernet frames with a header of four bytes: they come on interfaces
-- of link type Ethernet. Frames of the IO exchange have neither type nor addresses: they come on link type USER0 (147), as
-- `servowire cnc --pcapng` writes them. FCS and CRC-8 are checked.
--
-- Use:      tshark -X lua_script:sorte.lua -r m.pcapng        or copy the file into Wireshark's plugin folder
-- Filter:   sorte, sorte.type == 1, sorte.crc_good == 0, sorte.io.address == 3
--
-- Layout after the published firmware (Processor SDK RTOS, PDK am335x 1.0.17, example sorte) and the design guide TIDEP-0061.

local sorte = Proto("sorte", "TI SORTE")

local types = {
    [1] = "DISCOVERY", [2] = "PARAM", [3] = "DELAY_REQ", [4] = "DELAY_RESP", [5] = "SYNC",
    [6] = "OUT", [7] = "IN", [8] = "ALARM", [9] = "DIAG", [10] = "RECON",
}
-- Bytes from DA to FCS, where a layout is published.
local lengths = { [1] = 1030, [2] = 40, [3] = 8, [4] = 8, [5] = 14 }

local f = {
    da = ProtoField.uint8("sorte.da", "Destination"),
    sa = ProtoField.uint8("sorte.sa", "Source"),
    type = ProtoField.uint8("sorte.type", "Type", base.DEC, types),
    status = ProtoField.uint8("sorte.status", "STATUS", base.HEX),
    last = ProtoField.bool("sorte.status.last", "LAST", 8, nil, 0x01),
    done = ProtoField.bool("sorte.status.done", "DONE", 8, nil, 0x02),
    error = ProtoField.bool("sorte.status.error", "ERROR", 8, nil, 0x04),
    change = ProtoField.bool("sorte.status.state_change", "STATE_CHANGE", 8, nil, 0x08),
    nibble = ProtoField.uint8("sorte.status.type", "Type nibble", base.HEX, nil, 0xf0),
    fcs = ProtoField.uint32("sorte.fcs", "FCS", base.HEX),
    crc_good = ProtoField.bool("sorte.crc_good", "Check good"),
    data = ProtoField.bytes("sorte.data", "Data"),
    count = ProtoField.uint16("sorte.discovery.devices", "Devices"),
    input = ProtoField.uint16("sorte.discovery.input", "Input bytes"),
    output = ProtoField.uint16("sorte.discovery.output", "Output bytes"),
    entry = ProtoField.bytes("sorte.discovery.entry", "Entry"),
    cycle = ProtoField.uint32("sorte.param.cycle_time", "Cycle time in ns"),
    sync_cycle = ProtoField.uint32("sorte.param.sync_cycle", "SYNC cycle"),
    delay_period = ProtoField.uint16("sorte.param.delay_period", "Delay period in ms"),
    delay_burst = ProtoField.uint8("sorte.param.delay_burst", "Delay burst"),
    delay_gap = ProtoField.uint8("sorte.param.delay_gap", "Delay gap in ms"),
    forward = ProtoField.uint32("sorte.param.forward_time", "Forwarding time in ns"),
    ipg = ProtoField.uint32("sorte.param.ipg", "Inter-packet gap in 5 ns"),
    t_in = ProtoField.uint32("sorte.param.t_in", "Input time in ns"),
    t_out = ProtoField.uint32("sorte.param.t_out", "Output time in ns"),
    topology = ProtoField.uint8("sorte.param.topology", "Topology", base.DEC, { [0] = "line", [1] = "ring", [2] = "redundant ring" }),
    diagnostics = ProtoField.uint8("sorte.param.diagnostics", "Diagnostics"),
    alarm = ProtoField.uint8("sorte.param.alarm", "Alarm"),
    crc_mode = ProtoField.uint8("sorte.param.crc_mode", "CRC mode", base.HEX),
    stamp = ProtoField.uint32("sorte.sync.time_stamp", "Time stamp in ns"),
    delay = ProtoField.uint16("sorte.sync.delay", "Delay from the master in ns"),
    address = ProtoField.uint8("sorte.io.address", "Address"),
    io_stamp = ProtoField.uint16("sorte.io.time_stamp", "Time stamp in ns, low half"),
    pto = ProtoField.uint16("sorte.io.pto", "PTO", base.HEX),
    command = ProtoField.uint16("sorte.io.command", "Command, or position (extension of servowire)"),
    drv = ProtoField.uint8("sorte.io.drv8711", "DRV8711 STATUS", base.HEX),
    position = ProtoField.uint16("sorte.io.position", "Reserved, or position (extension of servowire)"),
    crc8 = ProtoField.uint8("sorte.io.crc8", "CRC-8", base.HEX),
}
sorte.fields = f

local bad_check = ProtoExpert.new("sorte.bad_check", "The check does not fit", expert.group.CHECKSUM, expert.severity.ERROR)
local bad_frame = ProtoExpert.new("sorte.bad_frame", "No frame of this type", expert.group.MALFORMED, expert.severity.ERROR)
sorte.experts = { bad_check, bad_frame }

-- Arithmetic on bits, for the Lua versions 5.2 to 5.4 that Wireshark has been built with.
local band, bxor, rshift, lshift, bnot
if bit32 then
    band, bxor, rshift, lshift, bnot = bit32.band, bit32.bxor, bit32.rshift, bit32.lshift, bit32.bnot
elseif bit then
    local u = function(x) return x % 4294967296 end
    band = function(a, b) return u(bit.band(a, b)) end
    bxor = function(a, b) return u(bit.bxor(a, b)) end
    rshift = function(a, n) return u(bit.rshift(a, n)) end
    lshift = function(a, n) return u(bit.lshift(a, n)) end
    bnot = function(a) return u(bit.bnot(a)) end
else
    band, bxor, rshift, lshift, bnot = load([[return
        function(a, b) return a & b end, function(a, b) return a ~ b end,
        function(a, n) return a >> n end, function(a, n) return (a << n) & 0xffffffff end,
        function(a) return ~a & 0xffffffff end]])()
end

-- Ethernet's CRC-32 and the CRC-8 with polynomial 7, a table each.
local crc32, crc8 = {}, {}
for n = 0, 255 do
    local c = n
    for _ = 1, 8 do
        c = band(c, 1) == 1 and bxor(rshift(c, 1), 0xedb88320) or rshift(c, 1)
    end
    crc32[n] = c
    c = n
    for _ = 1, 8 do
        c = band(c, 0x80) ~= 0 and band(bxor(lshift(c, 1), 7), 0xff) or band(lshift(c, 1), 0xff)
    end
    crc8[n] = c
end

local function fcs_of(bytes, len)
    local c = 0xffffffff
    for n = 0, len - 1 do
        c = bxor(crc32[band(bxor(c, bytes:get_index(n)), 0xff)], rshift(c, 8))
    end
    return bnot(c)
end

local function crc8_of(bytes, len)
    local c = 0
    for n = 0, len - 1 do
        c = crc8[bxor(c, bytes:get_index(n))]
    end
    return c
end

local function status(tree, tvb)
    local t = tree:add(f.status, tvb)
    for _, field in ipairs({ f.last, f.done, f.error, f.change, f.nibble }) do
        t:add(field, tvb)
    end
    local names = {}
    local v = tvb:uint()
    for n, name in ipairs({ "LAST", "DONE", "ERROR", "STATE_CHANGE" }) do
        if band(v, lshift(1, n - 1)) ~= 0 then
            names[#names + 1] = name
        end
    end
    return table.concat(names, " ")
end

local function check(tree, field, tvb, got, want)
    tree:add_le(field, tvb)
    local good = got == want
    tree:add(f.crc_good, tvb, good):set_generated()
    if not good then
        tree:add_proto_expert_info(bad_check, string.format("%x in the frame, its bytes give %x", got, want))
    end
    return good
end

local function param(tree, tvb)
    local fields = {
        { f.cycle, 4 }, { f.sync_cycle, 4 }, { f.delay_period, 2 }, { f.delay_burst, 1 }, { f.delay_gap, 1 },
        { f.forward, 4 }, { f.ipg, 4 }, { f.t_in, 4 }, { f.t_out, 4 }, { f.topology, 1 }, { f.diagnostics, 1 },
        { f.alarm, 1 }, { f.crc_mode, 1 },
    }
    local at = 4
    for _, field in ipairs(fields) do
        tree:add_le(field[1], tvb(at, field[2]))
        at = at + field[2]
    end
end

local function start_up(tvb, pinfo, root)
    local len = tvb:len()
    if len < 8 then
        return 0
    end
    pinfo.cols.protocol = "SORTE"
    local tree = root:add(sorte, tvb())
    tree:add(f.da, tvb(0, 1))
    tree:add(f.sa, tvb(1, 1))
    tree:add(f.type, tvb(2, 1))
    local flags = status(tree, tvb(3, 1))
    local code = tvb(2, 1):uint()
    local good = check(tree, f.fcs, tvb(len - 4, 4), tvb(len - 4, 4):le_uint(), fcs_of(tvb:bytes(), len - 4))
    local info = types[code] or string.format("type %d", code)
    if lengths[code] and lengths[code] ~= len then
        tree:add_proto_expert_info(bad_frame, string.format("%d bytes, the type has %d", len, lengths[code]))
    elseif code == 1 then
        local count = tvb(4, 2):le_uint()
        tree:add_le(f.count, tvb(4, 2))
        tree:add_le(f.input, tvb(6, 2))
        tree:add_le(f.output, tvb(8, 2))
        for a = 1, math.min(count, 254) do
            local at = 10 + 4 * (a - 1)
            local entry = tree:add(f.entry, tvb(at, 4))
            entry:set_text(string.format("Device %d: %d in, %d out", a, tvb(at, 2):le_uint(), tvb(at + 2, 2):le_uint()))
        end
        info = string.format("%s %d devices", info, count)
    elseif code == 2 then
        param(tree, tvb)
        info = string.format("%s cycle %d ns", info, tvb(4, 4):le_uint())
    elseif code == 5 then
        tree:add_le(f.stamp, tvb(4, 4))
        tree:add_le(f.delay, tvb(8, 2))
        info = string.format("%s at %d ns, delay %d ns", info, tvb(4, 4):le_uint(), tvb(8, 2):le_uint())
    elseif len > 8 then
        tree:add(f.data, tvb(4, len - 8))
    end
    pinfo.cols.info = info .. (flags ~= "" and ", " .. flags or "") .. (good and "" or ", bad FCS")
    return len
end

-- A step word as people say it: +1234, -1, +. for no pulse.
local function word(value)
    local sign = value >= 0x8000 and "-" or "+"
    local time = value % 0x8000
    if time == 0 then
        return sign .. "."
    elseif time <= 3990 then
        return sign .. time
    elseif value == 0x7fff then
        return "off"
    end
    return string.format("%04Xh?", value)
end

local function exchange(tvb, pinfo, root)
    local len = tvb:len()
    if len < 3 then
        return 0
    end
    pinfo.cols.protocol = "SORTE"
    local tree = root:add(sorte, tvb())
    local bytes = tvb:bytes()
    tree:add(f.address, tvb(0, 1))
    local flags = status(tree, tvb(1, 1))
    local info, good
    if tvb(0, 1):uint() == 0 and len >= 5 then
        local output = len - 5
        local words = {}
        if output % 4 == 0 then
            for at = 2, 2 + output - 4, 4 do
                local slice = tree:add(f.data, tvb(at, 4))
                words[#words + 1] = word(tvb(at, 2):le_uint())
                slice:set_text(string.format("Device %d: %s", #words, words[#words]))
                slice:add_le(f.pto, tvb(at, 2))
                slice:add_le(f.command, tvb(at + 2, 2))
            end
        elseif output > 0 then
            tree:add(f.data, tvb(2, output))
        end
        good = check(tree, f.crc8, tvb(2 + output, 1), tvb(2 + output, 1):uint(), crc8_of(bytes, 2 + output))
        tree:add_le(f.io_stamp, tvb(len - 2, 2))
        info = "master " .. table.concat(words, " ", 1, math.min(#words, 8))
    else
        local payload = len - 3
        if payload == 3 then
            tree:add(f.drv, tvb(2, 1))
            tree:add_le(f.position, tvb(3, 2))
        elseif payload > 0 then
            tree:add(f.data, tvb(2, payload))
        end
        good = check(tree, f.crc8, tvb(len - 1, 1), tvb(len - 1, 1):uint(), crc8_of(bytes, len - 1))
        info = string.format("device %d", tvb(0, 1):uint())
    end
    pinfo.cols.info = info .. (flags ~= "" and ", " .. flags or "") .. (good and "" or ", bad CRC-8")
    return len
end

sorte.dissector = start_up

-- The exchange.
local io = Proto("sorte_io", "TI SORTE IO exchange")
function io.dissector(tvb, pinfo, root)
    return exchange(tvb, pinfo, root)
end
DissectorTable.get("wtap_encap"):add(wtap.USER0, io)

-- The start-up: Ethernet takes the frames that begin with 255, 0 and a known type. Everything else stays what it was.
local ethernet = DissectorTable.get("wtap_encap"):get_dissector(wtap.ETHERNET)
local start = Proto("sorte_start", "TI SORTE start-up")
function start.dissector(tvb, pinfo, root)
    local whole = tvb:len() >= 8 and tvb(0, 1):uint() == 255 and tvb(1, 1):uint() == 0
    local code = whole and tvb(2, 1):uint() or 0
    -- A broadcast has 255 in its third byte too; all lengths of SORTE are known.
    if types[code] and (lengths[code] == tvb:len() or not lengths[code]) then
        return start_up(tvb, pinfo, root)
    end
    return ethernet:call(tvb, pinfo, root)
end
DissectorTable.get("wtap_encap"):add(wtap.ETHERNET, start)
