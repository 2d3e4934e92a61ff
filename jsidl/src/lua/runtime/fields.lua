-- The dissector's protocols, and every field that a filter can name. The tables `value_names`,
-- `field_table` and `message_table` stand above this.

local jaus = Proto("jaus", "JAUS")
local jtcp = Proto("jtcp", "JAUS over TCP")

local function kind_of_field(kind, abbreviation, name, names)
    if kind == "uint" then
        return ProtoField.uint32(abbreviation, name, base.DEC, names)
    elseif kind == "uint64" then
        return ProtoField.uint64(abbreviation, name, base.DEC, names)
    elseif kind == "int" then
        return ProtoField.int32(abbreviation, name, base.DEC, names)
    elseif kind == "int64" then
        return ProtoField.int64(abbreviation, name, base.DEC, names)
    elseif kind == "real" then
        return ProtoField.double(abbreviation, name)
    elseif kind == "text" then
        return ProtoField.string(abbreviation, name)
    elseif kind == "octets" then
        return ProtoField.bytes(abbreviation, name)
    end
    return ProtoField.none(abbreviation, name)
end

-- The fields of message bodies, by their position in `field_table`.
local body_fields = {}
for index, entry in ipairs(field_table) do
    local abbreviation, name, kind, names = entry[1], entry[2], entry[3], entry[4]
    body_fields[index] = kind_of_field(kind, abbreviation, name, names and value_names[names])
end

local priorities = { [0] = "low", [1] = "standard", [2] = "high", [3] = "safety critical" }
local broadcasts = { [0] = "none", [1] = "local", [2] = "global", [3] = "undefined" }
local acknowledgements = { [0] = "none", [1] = "request", [2] = "NAK", [3] = "ACK" }
local data_controls = { [0] = "single", [1] = "first", [2] = "middle", [3] = "last" }
local transports = { [0] = "RA 3.x", [1] = "AS5669", [2] = "AS5669A" }

-- The fields of the transport's headers, and those that all messages have.
local header = {
    version = ProtoField.uint8("jaus.transport", "Transport", base.DEC, transports),
    type = ProtoField.uint8("jaus.type", "Message type", base.DEC, nil, 0x3F),
    hc_flags = ProtoField.uint8("jaus.hc_flags", "Header compression", base.DEC, nil, 0xC0),
    size = ProtoField.uint16("jaus.size", "Data size", base.DEC),
    hc_number = ProtoField.uint8("jaus.hc_number", "Header compression number"),
    hc_length = ProtoField.uint8("jaus.hc_length", "Header compression length"),
    priority = ProtoField.uint8("jaus.priority", "Priority", base.DEC, priorities, 0x03),
    broadcast = ProtoField.uint8("jaus.broadcast", "Broadcast", base.DEC, broadcasts, 0x0C),
    acknowledgement = ProtoField.uint8("jaus.acknowledgement", "Acknowledgement", base.DEC,
        acknowledgements, 0x30),
    data_control = ProtoField.uint8("jaus.data_control", "Data control", base.DEC, data_controls),
    ra_priority = ProtoField.uint8("jaus.ra_priority", "Priority (0 to 15)", base.DEC, nil, 0x0F),
    service_connection = ProtoField.bool("jaus.service_connection", "Service connection", 8, nil, 0x40),
    experimental = ProtoField.bool("jaus.experimental", "Experimental", 8, nil, 0x80),
    ra_version = ProtoField.uint8("jaus.ra_version", "Header version", base.DEC, nil, 0x3F),
    source = ProtoField.string("jaus.source", "Source"),
    destination = ProtoField.string("jaus.destination", "Destination"),
    address = ProtoField.string("jaus.address", "Source or destination"),
    sequence = ProtoField.uint16("jaus.sequence", "Sequence number", base.DEC),
    code = ProtoField.uint16("jaus.code", "Message code", base.HEX),
    message = ProtoField.string("jaus.message", "Message"),
    service = ProtoField.string("jaus.service", "Service"),
    presence = ProtoField.uint64("jaus.presence_vector", "Presence vector", base.HEX),
    data = ProtoField.bytes("jaus.data", "Data"),
    fragment = ProtoField.framenum("jaus.fragment", "Fragment", base.NONE),
    whole_in = ProtoField.framenum("jaus.whole_in", "Large message complete in", base.NONE),
}
local parts = {
    source = {
        subsystem = ProtoField.uint16("jaus.source.subsystem", "Subsystem"),
        node = ProtoField.uint8("jaus.source.node", "Node"),
        component = ProtoField.uint8("jaus.source.component", "Component"),
        instance = ProtoField.uint8("jaus.source.instance", "Instance"),
    },
    destination = {
        subsystem = ProtoField.uint16("jaus.destination.subsystem", "Subsystem"),
        node = ProtoField.uint8("jaus.destination.node", "Node"),
        component = ProtoField.uint8("jaus.destination.component", "Component"),
        instance = ProtoField.uint8("jaus.destination.instance", "Instance"),
    },
}

local experts = {
    malformed = ProtoExpert.new("jaus.malformed", "Malformed", expert.group.MALFORMED,
        expert.severity.ERROR),
    limits = ProtoExpert.new("jaus.limits", "A count outside its limits", expert.group.PROTOCOL,
        expert.severity.WARN),
    unknown = ProtoExpert.new("jaus.unknown", "Unknown message code", expert.group.UNDECODED,
        expert.severity.NOTE),
    stale = ProtoExpert.new("jaus.stale", "Octets behind the last message", expert.group.PROTOCOL,
        expert.severity.NOTE),
    fault = ProtoExpert.new("jaus.fault", "A fault of this dissector", expert.group.DEBUG,
        expert.severity.ERROR),
}

do
    local all = {}
    for _, field in ipairs(body_fields) do
        all[#all + 1] = field
    end
    for _, set in ipairs({ header, parts.source, parts.destination }) do
        for _, field in pairs(set) do
            all[#all + 1] = field
        end
    end
    jaus.fields = all
    local all_experts = {}
    for _, one in pairs(experts) do
        all_experts[#all_experts + 1] = one
    end
    jaus.experts = all_experts
end

-- The definitions of each message code, the one to be tried first in front.
local function by_code(entries)
    local messages = {}
    for _, entry in ipairs(entries) do
        local code = entry[1]
        local known = messages[code] or {}
        known[#known + 1] = {
            name = entry[2],
            field = body_fields[entry[3]],
            services = entry[4],
            sections = entry[5],
        }
        messages[code] = known
    end
    return messages
end

-- The two families of messages, which share codes. What peers of the Reference Architecture write
-- amiss is forgiven: presence vectors with bits that no field has, a text at the end that is shorter
-- than it should be, and a vector of one bit where definitions have a tag.
local of_services = { messages = by_code(message_table) }
local of_ra = { messages = by_code(ra_message_table), forgiving = true }
