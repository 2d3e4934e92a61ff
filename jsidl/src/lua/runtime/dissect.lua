-- What Wireshark calls: a datagram, or what is there of a stream.

local JAUS_PORT = 3794

-- Whether a message behind another could have been written on purpose: one peer leaves stale octets.
local function is_plausible(frame)
    return frame.kind == 0 and is_unicast(frame.source) and not has_zero(frame.destination)
        and frame.broadcast ~= 3
        and (frame.acknowledgement < 2 or frame.body_at == frame.body_limit)
end

local function parse_datagram(tvb, at, version)
    if version == 2 then
        return parse_as5669a(tvb, at)
    elseif version == 0 then
        return parse_ra(tvb, at, 0)
    elseif tvb:len() - at < 4 + RA_HEADER then
        return problem_at(at, string.format("a message has at least 20 octets, here are %d", tvb:len() - at))
    elseif tvb:range(at, 2):uint() ~= 0 then
        return problem_at(at, "the header is compressed")
    end
    return parse_ra(tvb, at + 4, 1)
end

-- Which transport wrote the datagram, and where its first message begins.
local function version_of(tvb)
    local first = tvb:range(0, 1):uint()
    if first == 2 or first == 1 then
        return first, 1
    elseif tvb:len() >= 8 and tvb:range(0, 8):raw() == "JAUS01.0" then
        return 0, 8
    end
end

local function finish(pinfo, summaries)
    pinfo.cols.protocol = "JAUS"
    if #summaries > 0 then
        pinfo.cols.info = table.concat(summaries, "; ")
    end
end

function jaus.init()
    forget_large_messages()
end

function jaus.dissector(tvb, pinfo, tree)
    if tvb:len() == 0 then
        return 0
    end
    local version, at = version_of(tvb)
    if not version then
        return 0
    end
    local summaries, sender = {}, nil
    repeat
        local frame, problem = parse_datagram(tvb, at, version)
        local node = frame and frame.source:match("^(.*)%.")
        if #summaries > 0 and not (frame and is_plausible(frame) and node == sender) then
            local stale = tree:add(jaus, tvb:range(at), "JAUS, octets behind the last message")
            stale:add_proto_expert_info(experts.stale)
            break
        elseif not frame then
            show_problem(tree, tvb, problem)
            break
        end
        sender = node
        summaries[#summaries + 1] = show_frame(tree, tvb, frame, pinfo.number)
        at = frame.limit
    until at >= tvb:len() or version == 0
    finish(pinfo, summaries)
    return tvb:len()
end

-- Streams whose messages are those of AS5669, by connection and direction.
local first_editions = {}
local tcp_stream = Field.new("tcp.stream")

function jtcp.init()
    first_editions = {}
end

local function direction_of(pinfo)
    local stream = tcp_stream()
    return string.format("%s:%d", stream and tostring(stream.value) or "", pinfo.src_port)
end

-- Whether an AS5669 message begins here: the two sizes agree. Nil if there is too little to tell.
local function is_first_edition(tvb, at)
    if tvb:len() - at < 2 + RA_HEADER then
        return nil
    end
    return tvb:range(at, 2):uint() == RA_HEADER + tvb:range(at + 14, 2):le_uint() % 4096
end

-- What stands at `at`: a length with what reads it; "version"; nil if more octets are needed; or
-- false and a problem.
local function look(tvb, at, direction)
    local left, first = tvb:len() - at, tvb:range(at, 1):uint()
    if first_editions[direction] then
        if first == 1 and left > 1 and is_first_edition(tvb, at + 1) then
            return "version"
        end
        local fits = is_first_edition(tvb, at)
        if fits == false then
            return false, { at = at, sentence = "the size in front of the header and the one in it differ" }
        end
        return fits and 2 + tvb:range(at, 2):uint() or nil
    end
    if left < 3 or (first == 1 and is_first_edition(tvb, at + 1) == nil) then
        return nil
    elseif first == 1 and is_first_edition(tvb, at + 1) then
        first_editions[direction] = true
        return "version"
    elseif first == 2 and tvb:range(at + 1, 1):uint() % 64 == 0 then
        return "version"
    end
    local size, least = tvb:range(at + 1, 2):le_uint(), AS5669A_LEAST + (first >= 64 and 2 or 0)
    if size < least then
        local sentence = "the data size %d is less than that of an empty message"
        return false, { at = at, sentence = string.format(sentence, size) }
    end
    return size
end

function jtcp.dissector(tvb, pinfo, tree)
    local direction, at, summaries = direction_of(pinfo), 0, {}
    while at < tvb:len() do
        local found, problem = look(tvb, at, direction)
        if found == false then
            show_problem(tree, tvb, problem)
            break
        elseif found == "version" then
            at = at + 1
        elseif found and found <= tvb:len() - at then
            local frame, wrong
            if first_editions[direction] then
                frame, wrong = parse_ra(tvb, at + 2, 1)
            else
                frame, wrong = parse_as5669a(tvb, at)
            end
            if not frame then
                show_problem(tree, tvb, wrong)
                break
            end
            summaries[#summaries + 1] = show_frame(tree, tvb, frame, pinfo.number)
            at = at + found
        elseif tvb:len() < tvb:reported_len() then
            show_problem(tree, tvb, { at = at, sentence = "the message goes on" })
            break
        else
            pinfo.desegment_offset = at
            pinfo.desegment_len = found and found - (tvb:len() - at) or DESEGMENT_ONE_MORE_SEGMENT
            break
        end
    end
    finish(pinfo, summaries)
    return tvb:len()
end

DissectorTable.get("udp.port"):add(JAUS_PORT, jaus)
DissectorTable.get("tcp.port"):add(JAUS_PORT, jtcp)
