-- Message bodies: octets to a tree of nodes, by the shapes of `message_table`. Nothing is shown
-- yet, so that several definitions of one code can be tried.
--
-- A node has `field`, `at`, `length`, and where they apply `value`, `text` (shown behind the
-- value), `octets` (where a blob lies), `composite`, `children`, `warning`, `message` (a nested
-- one). What does not fit its definition raises a fault: a table with the place and a sentence.

local MOST_EMPTY_ELEMENTS = 4096
local DEEPEST_MESSAGE = 8

local function fault(at, sentence)
    error({ at = at, sentence = sentence })
end

local function take(reader, length)
    local at = reader.position
    local left = reader.limit - at
    if length > left then
        fault(at, string.format("octets needed: %.0f, left: %d", length, left))
    end
    reader.position = at + length
    return at
end

local function range(reader, at, length)
    return reader.tvb:range(at, length)
end

-- A number, or a UInt64 if it has 8 octets.
local function unsigned(reader, size)
    local at = take(reader, size)
    if size == 8 then
        return range(reader, at, 8):le_uint64(), at
    end
    return range(reader, at, size):le_uint(), at
end

local function count(reader, size, min, max)
    local number = unsigned(reader, size)
    if size == 8 then
        number = number:tonumber()
    end
    local warning
    if min and (number < min or number > max) then
        warning = string.format("a count of %.0f, where %.0f to %.0f are defined", number, min, max)
    end
    return number, warning
end

-- Bits from..to of a number or UInt64, as a number if they are at most 32.
local function bits(value, from, to)
    if type(value) == "number" then
        return math.floor(value / 2 ^ from) % 2 ^ (to - from + 1)
    end
    local part = value:lshift(63 - to):rshift(63 - to + from)
    return to - from < 32 and part:tonumber() or part
end

-- The decimal with the fewest digits that `accept` answers when it is offered the nearest of so many.
local function shortest(exact, accept)
    for digits = 1, 16 do
        local real = tonumber(string.format("%." .. digits .. "g", exact))
        local accepted = real and accept(real, digits)
        if accepted then
            return accepted
        end
    end
    return exact
end

local function short_float(value, octets)
    return shortest(value, function(real)
        return Struct.pack("<f", real) == octets and real
    end)
end

local to_integer = {
    round = function(real) return math.floor(real + 0.5) end,
    floor = math.floor,
    ceiling = math.ceil,
}

local function unscaled(raw, kind, lower, upper, rounding)
    local size = tonumber(kind:sub(2))
    local most = 2 ^ (8 * size) - 1
    local signed = kind:sub(1, 1) == "i"
    if signed then
        -- 0 is the centre, and the least integer is one step below the range.
        most = most - 1
        raw = raw + most / 2
    end
    local step = (upper - lower) / most
    local least = signed and lower - 1.5 * step or lower
    local convert = to_integer[rounding or "round"]
    local function is_same(real)
        return real >= least and real <= upper and convert((real - lower) / step) == raw
    end
    if is_same(0) then
        return 0
    end
    local exact = raw * step + lower
    return shortest(exact, function(real, digits)
        if real < least or real > upper then
            -- The nearest of so many digits lies beyond the range: its neighbour may be inside.
            local exponent = tonumber(string.format("%.0e", real):match("e(.*)$"))
            local unit = 10 ^ (exponent - digits + 1)
            local text = string.format("%." .. digits .. "g", real + (real < least and unit or -unit))
            real = tonumber(text)
        end
        return is_same(real) and real
    end)
end

-- Value and octets of a number, by its type such as "u2".
local function number(reader, kind)
    local class, size = kind:sub(1, 1), tonumber(kind:sub(2))
    if class == "u" then
        local value, at = unsigned(reader, size)
        return value, at, size
    end
    local at = take(reader, size)
    local octets = range(reader, at, size)
    if class == "i" then
        return size == 8 and octets:le_int64() or octets:le_int(), at, size
    end
    local value = octets:le_float()
    return size == 4 and short_float(value, octets:raw()) or value, at, size
end

local function unit_text(units)
    return units and " " .. units or nil
end

local readers = {}

local function read(reader, shape)
    local node = { field = body_fields[shape[2]], at = reader.position }
    -- In place before it is read: what was read before a fault is shown.
    local siblings = reader.nodes
    siblings[#siblings + 1] = node
    readers[shape[1]](reader, node, shape)
    node.length = reader.position - node.at
    return node
end

-- Reads what is inside of a node.
local function inside(reader, node, body)
    local siblings = reader.nodes
    node.children = node.children or {}
    reader.nodes = node.children
    body()
    reader.nodes = siblings
end

local function members(reader, presence_size, shapes)
    local presence, bit = 0, 0
    if presence_size then
        local value, at = unsigned(reader, presence_size)
        presence = value
        local node = { field = header.presence, at = at, length = presence_size }
        node.value = type(value) == "number" and UInt64.new(value) or value
        reader.nodes[#reader.nodes + 1] = node
        local optional = 0
        for _, shape in ipairs(shapes) do
            optional = optional + (shape[1] == "optional" and 1 or 0)
        end
        local width = 8 * presence_size
        if not reader.family.forgiving and optional < width and bits(value, optional, width - 1) ~= 0
            and bits(value, optional, width - 1) ~= UInt64.new(0) then
            fault(at, string.format("the presence vector has bits above the %d that are defined", optional))
        end
    end
    for _, shape in ipairs(shapes) do
        if shape[1] ~= "optional" then
            read(reader, shape)
        else
            if bits(presence, bit, bit) == 1 then
                read(reader, shape[2])
            end
            bit = bit + 1
        end
    end
end

local function elements(reader, node, number_of_elements, shape)
    inside(reader, node, function()
        for index = 0, number_of_elements - 1 do
            local start = reader.position
            local element = read(reader, shape)
            element.index = index
            if reader.position == start then
                reader.empty = reader.empty + 1
                if reader.empty > MOST_EMPTY_ELEMENTS then
                    fault(start, "there are too many elements without octets")
                end
            end
        end
    end)
end

readers["group"] = function(reader, node, shape)
    node.composite = true
    inside(reader, node, function()
        members(reader, shape[3], shape[4])
    end)
end

readers["list"] = function(reader, node, shape)
    node.value, node.warning = count(reader, shape[3], shape[5], shape[6])
    elements(reader, node, node.value, shape[4])
end

readers["array"] = function(reader, node, shape)
    node.composite = true
    elements(reader, node, shape[3], shape[4])
end

readers["variant"] = function(reader, node, shape)
    local at = reader.position
    local tag = count(reader, shape[3])
    local alternatives = shape[4]
    if reader.family.forgiving and tag > 1 and not alternatives[tag + 1] then
        tag = tag % 2
    end
    node.value = tag
    local chosen = alternatives[tag + 1]
    if chosen then
        inside(reader, node, function()
            read(reader, chosen)
        end)
    elseif tag > 0 or #alternatives > 0 then
        fault(at, string.format("the tag is %.0f, and there are %d alternatives", tag, #alternatives))
    end
end

readers["number"] = function(reader, node, shape)
    node.value = number(reader, shape[3])
    node.text = unit_text(shape[4])
end

readers["scaled"] = function(reader, node, shape)
    local raw = number(reader, shape[3])
    node.value = unscaled(raw, shape[3], shape[4], shape[5], shape[7])
    node.text = string.format("%s (%.0f)", unit_text(shape[6]) or "", raw)
end

readers["bits"] = function(reader, node, shape)
    local size = shape[3]
    local value, at = unsigned(reader, size)
    node.value = value
    inside(reader, node, function()
        for _, part in ipairs(shape[4]) do
            local child = { field = body_fields[part[1]], at = at, length = size }
            child.value = bits(value, part[2], part[3])
            reader.nodes[#reader.nodes + 1] = child
        end
    end)
end

local function text(reader, at, length)
    local octets = length > 0 and range(reader, at, length):raw() or ""
    while length > 0 and octets:byte(length) == 0 do
        length = length - 1
    end
    return length > 0 and range(reader, at, length):string(ENC_UTF_8) or ""
end

readers["fixed string"] = function(reader, node, shape)
    local length = shape[3]
    if reader.family.forgiving then
        length = math.min(length, reader.limit - reader.position)
    end
    local at = take(reader, length)
    node.value = text(reader, at, length)
end

readers["string"] = function(reader, node, shape)
    local length
    length, node.warning = count(reader, shape[3], shape[4], shape[5])
    node.value = text(reader, take(reader, length), length)
end

local read_message

-- Octets behind their count; those of a message are read as one.
local function blob(reader, node, size, min, max, is_message)
    local length
    length, node.warning = count(reader, size, min, max)
    local at = take(reader, length)
    node.octets = { at = at, length = length }
    if is_message and length > 0 then
        node.message = read_message(reader.tvb, at, at + length, reader.depth + 1, reader.family)
    end
end

readers["blob"] = function(reader, node, shape)
    blob(reader, node, shape[3], shape[4], shape[5], shape[6])
end

readers["formatted"] = function(reader, node, shape)
    local format, at = unsigned(reader, 1)
    node.children = { { field = body_fields[shape[4]], at = at, length = 1, value = format } }
    blob(reader, node, shape[3], shape[6], shape[7], shape[5][format])
end

readers["measure"] = function(reader, node, shape)
    local index, at = unsigned(reader, 1)
    node.children = { { field = body_fields[shape[3]], at = at, length = 1, value = index } }
    local choice = shape[4][index]
    if not choice then
        fault(at, string.format("no type and units have the index %d", index))
    end
    readers[choice[1]](reader, node, choice)
    if type(node.value) ~= "number" then
        -- A 64-bit integer: its field is a real number, its text has all digits.
        node.text = " = " .. tostring(node.value) .. (node.text or "")
        node.value = node.value:tonumber()
    end
end

-- The body by one definition: nodes, and the fault if there is one.
local function read_by(definition, tvb, at, limit, depth, family)
    local reader = {
        tvb = tvb, position = at, limit = limit, depth = depth, family = family, nodes = {}, empty = 0,
    }
    local nodes = reader.nodes
    local fine, problem = pcall(function()
        for _, section in ipairs(definition.sections) do
            if section[1] == "group" then
                members(reader, section[3], section[4])
            else
                read(reader, section)
            end
        end
        if reader.position < limit then
            local left = limit - reader.position
            fault(reader.position, string.format("octets behind the message's end: %d", left))
        end
    end)
    if fine then
        return nodes
    elseif type(problem) ~= "table" then
        return nodes, { at = at, sentence = tostring(problem), own = true }
    end
    return nodes, problem
end

-- A message of a family whose code is known and whose body lies between `at` and `limit`.
local function read_body(tvb, code, at, limit, depth, family)
    local message = { tvb = tvb, code = code, at = at, limit = limit }
    for _, definition in ipairs(family.messages[code] or {}) do
        local nodes, problem = read_by(definition, tvb, at, limit, depth, family)
        if not problem or not message.definition then
            message.definition, message.nodes, message.problem = definition, nodes, problem
        end
        if not problem then
            break
        end
    end
    return message
end

-- A message that begins with its code; nil if it has none or lies too deep.
read_message = function(tvb, at, limit, depth, family)
    if limit - at < 2 or depth > DEEPEST_MESSAGE then
        return nil
    end
    local code = tvb:range(at, 2):le_uint()
    local message = read_body(tvb, code, at + 2, limit, depth, family)
    message.code_at = at
    return message
end

-- The message of a frame: of the families that it may belong to by its header, the one whose
-- definition fits. `read` reads by one of them. Nil for what may not be read by the services'
-- definitions, and is unknown to the Reference Architecture.
local function read_by_header(frame, read)
    local message = frame.ra and read(of_ra)
    local is_known = message and message.definition
    if is_known and (frame.version == 0 or not message.problem) then
        return message
    elseif frame.version == 0 then
        return nil
    end
    -- Through the header of AS5669 a message of the services may come from a subsystem that looks
    -- like one of the Reference Architecture.
    local other = read(of_services)
    local fits = other and other.definition and not other.problem
    return is_known and not fits and message or other
end
