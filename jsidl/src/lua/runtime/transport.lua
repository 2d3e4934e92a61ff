-- The transport's headers, in datagrams and in streams.

local AS5669A_LEAST, RA_HEADER = 14, 16
local RA_DATA_CONTROLS = { [0] = 0, [1] = 1, [2] = 2, [4] = 2, [8] = 3 }

-- An id as people write it, the Reference Architecture's with four numbers.
local function id_of(tvb, at, has_four)
    local component, node = tvb:range(at, 1):uint(), tvb:range(at + 1, 1):uint()
    if has_four then
        return string.format("%d.%d.%d.%d", tvb:range(at + 3, 1):uint(), tvb:range(at + 2, 1):uint(),
            node, component)
    end
    return string.format("%d.%d.%d", tvb:range(at + 2, 2):le_uint(), node, component)
end

-- Whether each of its numbers is that of one: no wildcard, not 0.
local function is_unicast(id)
    local subsystem, node, component = id:match("^(%d+)%.(%d+)%.(%d+)$")
    return subsystem ~= "65535" and node ~= "255" and component ~= "255"
        and subsystem ~= "0" and node ~= "0" and component ~= "0"
end

local function has_zero(id)
    return id:match("^0%.") or id:match("%.0%.") or id:match("%.0$")
end

local function problem_at(at, sentence)
    return nil, { at = at, sentence = sentence }
end

-- The AS5669A message at `at`; or nil and why there is none.
local function parse_as5669a(tvb, at)
    local available = tvb:len() - at
    if available < AS5669A_LEAST then
        return problem_at(at, string.format("a message has at least 14 octets, here are %d", available))
    end
    local kind, size = tvb:range(at, 1):uint(), tvb:range(at + 1, 2):le_uint()
    local extra = kind >= 64 and 2 or 0
    if size < AS5669A_LEAST + extra then
        return problem_at(at, string.format("the data size %d is less than that of an empty message", size))
    elseif size > available then
        return problem_at(at, string.format("the data size is %d; octets left: %d", size, available))
    end
    local flags = tvb:range(at + 3 + extra, 1):uint()
    return {
        version = 2, at = at, limit = at + size, kind = kind, extra = extra, flags_at = at + 3 + extra,
        broadcast = bits(flags, 2, 3), acknowledgement = bits(flags, 4, 5), data_control = bits(flags, 6, 7),
        destination_at = at + 4 + extra, source_at = at + 8 + extra,
        destination = id_of(tvb, at + 4 + extra), source = id_of(tvb, at + 8 + extra),
        sequence = tvb:range(at + size - 2, 2):le_uint(), sequence_at = at + size - 2,
        body_at = at + 12 + extra, body_limit = at + size - 2,
    }
end

-- The message with the RA header, which AS5669 took over.
local function parse_ra(tvb, at, version)
    local available = tvb:len() - at
    if available < RA_HEADER then
        return problem_at(at, string.format("a header has 16 octets, here are %d", available))
    end
    local control = tvb:range(at + 12, 2):le_uint()
    local size, data_control = control % 4096, RA_DATA_CONTROLS[math.floor(control / 4096)]
    if not data_control then
        return problem_at(at + 12, "the data control is not defined")
    elseif size > available - RA_HEADER then
        return problem_at(at + 12, string.format("the data size is %d; octets left: %d", size,
            available - RA_HEADER))
    end
    -- The older headers carry messages of the services as well. But the first of the four numbers of
    -- an id in the Reference Architecture is never 0, and among ids with three numbers only those of
    -- subsystems from 256 on have another octet there.
    local ra = tvb:range(at + 11, 1):uint() ~= 0
    local has_four = version == 0 or ra
    return {
        version = version, at = at, limit = at + RA_HEADER + size, flags_at = at, kind = 0, broadcast = 0,
        ra = ra,
        acknowledgement = bits(tvb:range(at, 1):uint(), 4, 5), data_control = data_control,
        code = tvb:range(at + 2, 2):le_uint(), code_at = at + 2,
        destination_at = at + 4, source_at = at + 8,
        destination = id_of(tvb, at + 4, has_four), source = id_of(tvb, at + 8, has_four),
        sequence = tvb:range(at + 14, 2):le_uint(), sequence_at = at + 14,
        body_at = at + RA_HEADER, body_limit = at + RA_HEADER + size,
    }
end

local function show_id(tree, tvb, role, at, id)
    local item = tree:add(header[role], tvb:range(at, 4), id)
    local subsystem, node, component = id:match("^(%d+)%.(%d+)%.(%d+)$")
    if subsystem then
        item:add(parts[role].subsystem, tvb:range(at + 2, 2), tonumber(subsystem))
        item:add(parts[role].node, tvb:range(at + 1, 1), tonumber(node))
        item:add(parts[role].component, tvb:range(at, 1), tonumber(component))
    else
        for place, part in ipairs({ "instance", "component", "node", "subsystem" }) do
            item:add(parts[role][part], tvb:range(at + place - 1, 1))
        end
    end
    tree:add(header.address, tvb:range(at, 4), id):set_hidden()
end

local function show_header(tree, tvb, frame)
    tree:add(header.version, tvb:range(frame.at, 0), frame.version):set_generated()
    local flags = tvb:range(frame.flags_at, 1)
    if frame.version == 2 then
        tree:add(header.type, tvb:range(frame.at, 1))
        tree:add(header.hc_flags, tvb:range(frame.at, 1))
        tree:add_le(header.size, tvb:range(frame.at + 1, 2))
        if frame.extra > 0 then
            tree:add(header.hc_number, tvb:range(frame.at + 3, 1))
            tree:add(header.hc_length, tvb:range(frame.at + 4, 1))
        end
        tree:add(header.priority, flags)
        tree:add(header.broadcast, flags)
        tree:add(header.acknowledgement, flags)
        tree:add(header.data_control, flags, frame.data_control)
    else
        tree:add(header.ra_priority, flags)
        tree:add(header.acknowledgement, flags)
        tree:add(header.service_connection, flags)
        tree:add(header.experimental, flags)
        tree:add(header.ra_version, tvb:range(frame.at + 1, 1))
        tree:add(header.size, tvb:range(frame.at + 12, 2), frame.body_limit - frame.body_at)
        tree:add(header.data_control, tvb:range(frame.at + 12, 2), frame.data_control)
    end
    show_id(tree, tvb, "destination", frame.destination_at, frame.destination)
    show_id(tree, tvb, "source", frame.source_at, frame.source)
    tree:add_le(header.sequence, tvb:range(frame.sequence_at, 2))
end

-- Puts a fragment where it belongs, and shows the message that it completes. Answers its summary.
local function show_fragment(tree, tvb, frame, frame_number)
    local body = tvb:range(frame.body_at, frame.body_limit - frame.body_at)
    local octets = body:len() > 0 and body:raw() or ""
    if frame.code then
        tree:add_le(header.code, tvb:range(frame.code_at, 2))
        octets = string.char(frame.code % 256, math.floor(frame.code / 256)) .. octets
    end
    tree:add(header.data, body)
    local summary = string.format("%s fragment", data_controls[frame.data_control])
    local known = add_fragment(frame, octets, frame_number)
    if known.whole_in and known.whole_in ~= frame_number then
        tree:add(header.whole_in, body, known.whole_in):set_generated()
    end
    if not known.whole then
        return summary
    end
    for _, number_of_frame in ipairs(known.whole.frames) do
        tree:add(header.fragment, body, number_of_frame):set_generated()
    end
    local message = read_by_header(frame, function(family)
        return read_whole(known.whole, family)
    end)
    if not message then
        return summary
    end
    show_message(tree, message)
    return string.format("%s (from %d fragments)", name_of(message), #known.whole.frames)
end

-- What a frame carries. Answers its summary.
local function show_payload(tree, tvb, frame, frame_number)
    local length = frame.body_limit - frame.body_at
    local is_answer = frame.acknowledgement >= 2
    if is_answer and length == 0 then
        return acknowledgements[frame.acknowledgement]
    elseif frame.data_control ~= 0 then
        return show_fragment(tree, tvb, frame, frame_number)
    end
    local message = read_by_header(frame, function(family)
        if not frame.code then
            return read_message(tvb, frame.body_at, frame.body_limit, 0, family)
        end
        local found = read_body(tvb, frame.code, frame.body_at, frame.body_limit, 0, family)
        found.code_at = frame.code_at
        return found
    end)
    if not message and frame.version == 0 then
        -- The Reference Architecture's messages share codes with the services' but not layouts.
        tree:add_le(header.code, tvb:range(frame.code_at, 2))
        tree:add(header.data, tvb:range(frame.body_at, length))
        return string.format("RA message %04Xh", frame.code)
    elseif not message then
        local item = tree:add(header.data, tvb:range(frame.body_at, length))
        item:add_proto_expert_info(experts.malformed, "a message starts with the two octets of its code")
        return "no message"
    end
    show_message(tree, message)
    return summary_of(message)
end

-- Shows a frame as a tree of its own. Answers its summary.
local function show_frame(tree, tvb, frame, frame_number)
    local item = tree:add(jaus, tvb:range(frame.at, frame.limit - frame.at))
    show_header(item, tvb, frame)
    local summary = show_payload(item, tvb, frame, frame_number)
    summary = string.format("%s %s -> %s", summary, frame.source, frame.destination)
    item:append_text(", " .. summary)
    return summary
end

local function show_problem(tree, tvb, problem)
    local item = tree:add(jaus, tvb:range(problem.at, tvb:len() - problem.at))
    local sentence = problem.sentence
    if tvb:len() < tvb:reported_len() then
        sentence = sentence .. " (the capture has only the beginning of this packet)"
    end
    item:add_proto_expert_info(experts.malformed, sentence)
end
