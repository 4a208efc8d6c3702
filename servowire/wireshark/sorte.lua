-- Wireshark dissector for TI SORTE (Simple Open Real-Time Ethernet).
--
-- Start-up frames (DISCOVERY, PARAM, DELAY_REQ, SYNC) are Ethernet frames with a header of four bytes: they come on interfaces
-- of link type Ethernet, with their FCS or, as nearly every network card gives them, without, and padded to 60 bytes. Frames of
-- the IO exchange have neither type nor addresses: they come on link type USER0 (147), as `servowire cnc --pcapng` writes them.
-- FCS and CRC-8 are checked where they are there. All other Ethernet traffic stays what it was.
--
-- Use:      tshark -X lua_script:sorte.lua -r m.pcapng        or copy the file into Wireshark's plugin folder
-- Filter:   sorte, sorte.type == 1, sorte.crc_good == 0, sorte.io.address == 3, sorte.io.cycle == 1000, sorte.io.missing == 2,
--           sorte.discovery.devices < 4, sorte.to_master == 1, sorte.io.late > 100, sorte.no_fcs, _ws.expert
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
    entry = ProtoField.uint8("sorte.discovery.address", "Address"),
    entry_in = ProtoField.uint16("sorte.discovery.entry.input", "Input bytes"),
    entry_out = ProtoField.uint16("sorte.discovery.entry.output", "Output bytes"),
    padding = ProtoField.bytes("sorte.padding", "Padding"),
    no_fcs = ProtoField.bool("sorte.no_fcs", "Captured without FCS"),
    to_master = ProtoField.bool("sorte.to_master", "On its way to the master"),
    io_cycle = ProtoField.uint32("sorte.io.cycle", "Cycle in this capture"),
    missing = ProtoField.uint8("sorte.io.missing", "Missing in the cycle before, device"),
    after = ProtoField.int32("sorte.io.after", "After its master frame in ns"),
    late = ProtoField.int32("sorte.io.late", "Later than in its first cycle in ns"),
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

local groups, levels = expert.group, expert.severity
local bad_check = ProtoExpert.new("sorte.bad_check", "The check does not fit", groups.CHECKSUM, levels.ERROR)
local bad_frame = ProtoExpert.new("sorte.bad_frame", "No frame of this type", groups.MALFORMED, levels.ERROR)
local bad_value = ProtoExpert.new("sorte.bad_value", "A value that cannot be", groups.PROTOCOL, levels.WARN)
local lost = ProtoExpert.new("sorte.lost", "A device frame is missing", groups.SEQUENCE, levels.WARN)
sorte.experts = { bad_check, bad_frame, bad_value, lost }

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

-- Which part of the bytes is the frame, and whether its FCS is there: as it is, without FCS, or padded by a network card.
local function extent(tvb, want)
    local len = tvb:len()
    if not want then
        return len, len >= 8
    elseif len == want then
        return want, true
    elseif len == want - 4 then
        return len, false
    elseif len > want then
        local bytes = tvb:bytes()
        local fits = tvb(want - 4, 4):le_uint() == fcs_of(bytes, want - 4)
        return fits and want or want - 4, fits
    end
    return len, nil
end

local function discovery(tree, tvb)
    local count = tvb(4, 2):le_uint()
    tree:add_le(f.count, tvb(4, 2))
    tree:add_le(f.input, tvb(6, 2))
    tree:add_le(f.output, tvb(8, 2))
    local input, output = 0, 0
    for a = 1, math.min(count, 254) do
        local at = 10 + 4 * (a - 1)
        local bytes_in, bytes_out = tvb(at, 2):le_uint(), tvb(at + 2, 2):le_uint()
        local entry = tree:add(f.entry, tvb(at, 4), a)
        entry:set_text(string.format("Device %d: %d in, %d out", a, bytes_in, bytes_out))
        entry:add_le(f.entry_in, tvb(at, 2))
        entry:add_le(f.entry_out, tvb(at + 2, 2))
        input, output = input + bytes_in, output + bytes_out
    end
    if count > 254 then
        tree:add_proto_expert_info(bad_value, string.format("%d devices, 254 can be", count))
    else
        for _, total in ipairs({ { "input", tvb(6, 2):le_uint(), input }, { "output", tvb(8, 2):le_uint(), output } }) do
            if total[2] ~= total[3] then
                local text = string.format("%d %s bytes in all, the entries sum to %d", total[2], total[1], total[3])
                tree:add_proto_expert_info(bad_value, text)
            end
        end
    end
    return string.format(" %d devices", count)
end

local function start_up(tvb, pinfo, root)
    local code = tvb(2, 1):uint()
    local want = lengths[code]
    local len, has_fcs = extent(tvb, want)
    pinfo.cols.protocol = "SORTE"
    local tree = root:add(sorte, tvb())
    tree:add(f.da, tvb(0, 1))
    tree:add(f.sa, tvb(1, 1))
    tree:add(f.type, tvb(2, 1))
    local flags = status(tree, tvb(3, 1))
    -- What has passed the last device is on its way back; PARAM and DELAY_REQ do not tell.
    if code == 1 or code == 5 then
        tree:add(f.to_master, tvb(3, 1), band(tvb(3, 1):uint(), 1) ~= 0):set_generated()
    end
    local info, note = types[code], ""
    if has_fcs == nil then
        tree:add_proto_expert_info(bad_frame, string.format("%d bytes, the type has %d", len, want))
        note = ", cut"
    else
        local body = has_fcs and len - 4 or len
        if has_fcs then
            local got = tvb(body, 4):le_uint()
            note = check(tree, f.fcs, tvb(body, 4), got, fcs_of(tvb:bytes(), body)) and "" or ", bad FCS"
        else
            tree:add(f.no_fcs, true):set_generated()
            note = ", no FCS"
        end
        if len < tvb:len() then
            tree:add(f.padding, tvb(len))
        end
        if code == 1 then
            info = info .. discovery(tree, tvb)
        elseif code == 2 then
            param(tree, tvb)
            if tvb(32, 1):uint() > 2 then
                tree:add_proto_expert_info(bad_value, string.format("topology %d", tvb(32, 1):uint()))
            end
            info = string.format("%s cycle %d ns", info, tvb(4, 4):le_uint())
        elseif code == 5 then
            tree:add_le(f.stamp, tvb(4, 4))
            tree:add_le(f.delay, tvb(8, 2))
            info = string.format("%s at %d ns, delay %d ns", info, tvb(4, 4):le_uint(), tvb(8, 2):le_uint())
        elseif body > 4 then
            tree:add(f.data, tvb(4, body - 4))
        end
    end
    pinfo.cols.info = info .. (flags ~= "" and ", " .. flags or "") .. note
    return tvb:len()
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

-- What the frames before have told, kept for each packet: Wireshark asks again in any order.
local line, kept = nil, {}
local function forget()
    line = { cycle = 0, heard = {}, known = {}, usual = {} }
    kept = {}
end
forget()
sorte.init = forget

-- A frame of the exchange, seen for the first time: its cycle, who was missing in the one before, when it came.
local function remember(pinfo, address, good)
    local now = pinfo.rel_ts
    local told = { cycle = line.cycle, missing = {} }
    if not good then
        return told
    end
    if address == 0 then
        if line.cycle > 0 then
            for a = 1, 254 do
                if line.known[a] and not line.heard[a] then
                    told.missing[#told.missing + 1] = a
                end
            end
        end
        line.cycle, line.heard, line.began = line.cycle + 1, {}, now
        told.cycle = line.cycle
    else
        line.heard[address], line.known[address] = true, true
        if line.began then
            told.after = math.floor((now - line.began) * 1e9 + 0.5)
            line.usual[address] = line.usual[address] or told.after
            told.late = told.after - line.usual[address]
        end
    end
    return told
end

local function exchange(tvb, pinfo, root)
    local len = tvb:len()
    pinfo.cols.protocol = "SORTE"
    local tree = root:add(sorte, tvb())
    if len < 3 or (tvb(0, 1):uint() == 0 and len < 5) or tvb(0, 1):uint() == 255 then
        tree:add(f.data, tvb())
        tree:add_proto_expert_info(bad_frame, string.format("%d bytes are no frame of the exchange", len))
        pinfo.cols.info = "no frame of the exchange"
        return len
    end
    local bytes, address = tvb:bytes(), tvb(0, 1):uint()
    tree:add(f.address, tvb(0, 1))
    tree:add(f.to_master, tvb(0, 1), address ~= 0):set_generated()
    local flags = status(tree, tvb(1, 1))
    local info, good
    if address == 0 then
        local output = len - 5
        local words = {}
        if output % 4 == 0 then
            for at = 2, 2 + output - 4, 4 do
                local slice = tree:add(f.data, tvb(at, 4))
                local value = tvb(at, 2):le_uint()
                words[#words + 1] = word(value)
                slice:set_text(string.format("Device %d: %s", #words, words[#words]))
                slice:add_le(f.pto, tvb(at, 2))
                slice:add_le(f.command, tvb(at + 2, 2))
                if value % 0x8000 > 3990 and value ~= 0x7fff then
                    tree:add_proto_expert_info(bad_value, string.format("PTO %04Xh has no meaning", value))
                end
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
        info = string.format("device %d", address)
    end
    local told = kept[pinfo.number]
    if not told then
        told = remember(pinfo, address, good)
        kept[pinfo.number] = told
    end
    tree:add(f.io_cycle, told.cycle):set_generated()
    for _, device in ipairs(told.missing) do
        tree:add(f.missing, device):set_generated()
        tree:add_proto_expert_info(lost, string.format("no frame of device %d in cycle %d", device, told.cycle - 1))
    end
    if told.after then
        tree:add(f.after, told.after):set_generated()
        tree:add(f.late, told.late):set_generated()
    end
    pinfo.cols.info = info .. (flags ~= "" and ", " .. flags or "") .. (good and "" or ", bad CRC-8")
    return len
end

-- Ethernet takes the frames that begin with 255, 0 and a known type, whatever is wrong with them; everything else stays what it was.
-- No other traffic begins so: a broadcast has 255 in its second and third byte too, and groups have other numbers.
local function is_start_up(tvb)
    return tvb:len() >= 4 and tvb(0, 1):uint() == 255 and tvb(1, 1):uint() == 0 and types[tvb(2, 1):uint()] ~= nil
end

-- The exchange.
local io = Proto("sorte_io", "TI SORTE IO exchange")
function io.dissector(tvb, pinfo, root)
    if tvb:len() == 0 then
        return 0
    end
    return exchange(tvb, pinfo, root)
end
DissectorTable.get("wtap_encap"):add(wtap.USER0, io)

function sorte.dissector(tvb, pinfo, root)
    return is_start_up(tvb) and start_up(tvb, pinfo, root) or 0
end

local ethernet = DissectorTable.get("wtap_encap"):get_dissector(wtap.ETHERNET)
local start = Proto("sorte_start", "TI SORTE start-up")
function start.dissector(tvb, pinfo, root)
    if is_start_up(tvb) then
        return start_up(tvb, pinfo, root)
    end
    -- Of a frame that the capture has cut, what there is: if a dissector runs into the cut, Wireshark leaves this script without
    -- Lua's knowledge, and after two hundred times Lua has no calls left.
    local there = tvb
    if tvb:reported_len() > tvb:len() and tvb:len() > 0 then
        there = tvb:bytes():tvb("Captured part")
    elseif tvb:reported_len() > tvb:len() then
        return 0
    end
    -- A frame that ends too early for what it says it is: what was found stays, and it is no error of this script.
    local whole = pcall(function() ethernet:call(there, pinfo, root) end)
    if not whole then
        root:add(start, tvb(), "Ethernet frame that ends too early")
    end
    return tvb:len()
end
DissectorTable.get("wtap_encap"):add(wtap.ETHERNET, start)
