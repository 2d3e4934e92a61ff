-- Large messages: fragments put together across packets, in both styles seen. AS5669A and Junior
-- cut a message as it is; JAUS++ and the older headers have its code in every fragment.

local MOST_OPEN = 64
local LONGEST = 16 * 1024 * 1024

-- Messages on their way, the oldest first; what became of each fragment, by its place.
local open_messages, fragments = {}, {}

local function forget_large_messages()
    open_messages, fragments = {}, {}
end

local function open_message(frame)
    local key = table.concat({ frame.source, frame.destination, frame.version }, ">")
    for index, open in ipairs(open_messages) do
        if open.key == key then
            local first, last = open.first or frame.sequence, open.last or frame.sequence
            local another = (frame.data_control == 1 and first ~= frame.sequence)
                or (frame.data_control == 3 and last ~= frame.sequence)
            if not another then
                return open, index
            end
            table.remove(open_messages, index)
            break
        end
    end
    if #open_messages == MOST_OPEN then
        table.remove(open_messages, 1)
    end
    local open = { key = key, pieces = {}, length = 0, count = 0 }
    open_messages[#open_messages + 1] = open
    return open, #open_messages
end

-- The pieces from the first to the last; nil while some are missing. Sequence numbers wrap around.
local function pieces_in_order(open)
    if not open.first or not open.last then
        return nil
    end
    local steps = (open.last - open.first) % 65536
    if steps >= open.count then
        return nil
    end
    local pieces = {}
    for step = 0, steps do
        local piece = open.pieces[(open.first + step) % 65536]
        if not piece then
            return nil
        end
        pieces[#pieces + 1] = piece
    end
    return pieces
end

-- The octets behind one another; of all but the first, `skip` are left out.
local function join(pieces, skip)
    local texts = {}
    for index, piece in ipairs(pieces) do
        texts[index] = index == 1 and piece.octets or piece.octets:sub(skip + 1)
    end
    return table.concat(texts)
end

local function whole_of(pieces, frame)
    local code = pieces[1].octets:sub(1, 2)
    if #code < 2 then
        return nil
    end
    local repeated = true
    for _, piece in ipairs(pieces) do
        repeated = repeated and piece.octets:sub(1, 2) == code
    end
    local whole = { frames = {} }
    for index, piece in ipairs(pieces) do
        whole.frames[index] = piece.frame_number
    end
    if frame.version == 2 then
        whole.octets = { join(pieces, 0), repeated and join(pieces, 2) or nil }
    elseif repeated then
        whole.octets = { join(pieces, 2) }
    else
        return nil
    end
    return whole
end

-- Adds the payload of a fragment when its packet is seen for the first time. Answers what is known
-- of the fragment: `whole` if it completes a message, `whole_in`, the packet that does.
local function add_fragment(frame, octets, frame_number)
    local place = table.concat({ frame_number, frame.source, frame.destination, frame.sequence }, ":")
    if fragments[place] then
        return fragments[place]
    end
    local known = {}
    fragments[place] = known
    local open, index = open_message(frame)
    if frame.data_control == 1 then
        open.first = frame.sequence
    elseif frame.data_control == 3 then
        open.last = frame.sequence
    end
    local before = open.pieces[frame.sequence]
    open.count = open.count + (before and 0 or 1)
    open.length = open.length + #octets - (before and #before.octets or 0)
    open.pieces[frame.sequence] = { octets = octets, frame_number = frame_number, known = known }
    if open.length > LONGEST then
        table.remove(open_messages, index)
        return known
    end
    local pieces = pieces_in_order(open)
    if pieces then
        table.remove(open_messages, index)
        known.whole = whole_of(pieces, frame)
        for _, piece in ipairs(pieces) do
            piece.known.whole_in = frame_number
        end
    end
    return known
end

-- The message in a whole: of its readings the first that fits its definition.
local function read_whole(whole, family)
    local chosen
    for _, octets in ipairs(whole.octets) do
        local tvb = ByteArray.new(octets, true):tvb("JAUS message")
        local message = read_message(tvb, 0, tvb:len(), 0, family)
        if not chosen or not message.problem then
            chosen = message
        end
        if not chosen.problem then
            break
        end
    end
    return chosen
end
