-- Nodes to items of Wireshark's tree.

local show_message

local function name_of(message)
    local definition = message.definition
    return definition and definition.name or string.format("message %04Xh", message.code)
end

-- The first message among nodes and what is in them.
local function first_inside(nodes)
    for _, node in ipairs(nodes or {}) do
        local message = node.message or first_inside(node.children)
        if message then
            return message
        end
    end
end

-- A message's name, with that of the message in it: `Event (ReportLocalPose)`.
local function summary_of(message)
    local inner = first_inside(message.nodes)
    return inner and string.format("%s (%s)", name_of(message), name_of(inner)) or name_of(message)
end

-- The item of a node; nil for a value that a fault left unread.
local function add_item(tree, tvb, node, fault_at)
    if node.octets then
        return tree:add(node.field, tvb:range(node.octets.at, node.octets.length))
    end
    local length = node.length or math.max((fault_at or node.at) - node.at, 0)
    if node.value ~= nil then
        return tree:add(node.field, tvb:range(node.at, length), node.value)
    elseif node.composite then
        return tree:add(node.field, tvb:range(node.at, length))
    end
end

local function show_node(tree, tvb, node, fault_at)
    local item = add_item(tree, tvb, node, fault_at)
    if not item then
        for _, child in ipairs(node.children or {}) do
            show_node(tree, tvb, child, fault_at)
        end
        return
    end
    if node.index then
        item:prepend_text(string.format("[%d] ", node.index))
    end
    if node.text then
        item:append_text(node.text)
    end
    if node.warning then
        item:add_proto_expert_info(experts.limits, node.warning)
    end
    for _, child in ipairs(node.children or {}) do
        show_node(item, tvb, child, fault_at)
    end
    if node.message then
        local place = tvb:range(node.octets.at, node.octets.length)
        local inner = item:add(jaus, place, "The message inside: " .. name_of(node.message))
        show_message(inner, node.message)
    end
end

-- The code and what is known by it.
local function show_code(tree, message)
    local tvb, at = message.tvb, message.code_at
    local place = at and tvb:range(at, 2) or tvb:range(message.at, 0)
    tree:add(header.code, place, message.code)
    local definition = message.definition
    if definition then
        tree:add(header.message, place, definition.name):set_generated()
        for _, service in ipairs(definition.services) do
            tree:add(header.service, place, service):set_generated()
        end
    end
end

show_message = function(tree, message)
    local tvb, definition = message.tvb, message.definition
    local body = tvb:range(message.at, message.limit - message.at)
    show_code(tree, message)
    if not definition then
        local item = tree:add(header.data, body)
        item:add_proto_expert_info(experts.unknown,
            string.format("no definition with the code %04Xh was loaded", message.code))
        return
    end
    local item = tree:add(definition.field, body)
    local problem = message.problem
    for _, node in ipairs(message.nodes) do
        show_node(item, tvb, node, problem and problem.at)
    end
    if problem then
        local kind = problem.own and experts.fault or experts.malformed
        local place = tvb:range(problem.at, message.limit - problem.at)
        local rest = item:add(header.data, place)
        rest:add_proto_expert_info(kind, string.format("%s, octet %d of the body: %s", definition.name,
            problem.at - message.at, problem.sentence))
    end
end
