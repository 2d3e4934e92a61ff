/* Each function refuses null pointers, and handles that are zero, freed or of another type; and a small
 * component in C answers a query. */
#include "jaus.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REQUIRE(condition)                                                                          \
    do {                                                                                            \
        if (!(condition)) {                                                                         \
            fprintf(stderr, "line %d: not so: %s (%s)\n", __LINE__, #condition, jaus_last_error()); \
            exit(1);                                                                                \
        }                                                                                           \
    } while (0)

static const uint8_t QUERY[] = {0x04, 0x24, 0x01, 0x00};
static const uint8_t REPORT[] = {0x04, 0x44, 0x00, 0x00};

static void ignore_event(void *user, const JausEvent *event) {
    (void)user;
    (void)event;
}

static void answer(void *user, const JausEvent *query, JausAnswer *reply) {
    int *count = user;
    ++*count;
    if (query->length != sizeof QUERY || memcmp(query->data, QUERY, sizeof QUERY) != 0) {
        return;
    }
    /* Malformed answers are refused. */
    if (jaus_answer_set(NULL, REPORT, sizeof REPORT) != JausStatus_NullPointer ||
        jaus_answer_set(reply, NULL, 2) != JausStatus_NullPointer ||
        jaus_answer_set(reply, REPORT, 1) != JausStatus_InvalidArgument) {
        *count = -1000;
    }
    jaus_answer_set(reply, REPORT, sizeof REPORT);
}

static void stop(void *user) { (void)user; }

/* Every function with a handle, given this number in each type of handle. */
static void refuse(uint64_t id) {
    const JausNode node = {id};
    const JausComponent component = {id};
    const JausService service = {id, 0};
    const JausSubscription subscription = {id};
    const JausControl control = {id};
    const JausAddress peer = {101, 1, 33};
    JausComponent made;
    JausService offered;
    JausSubscription subscribed;
    JausControl controlled;
    JausAddress address;
    JausMessage message = {NULL, 0};
    JausSubscriptionState state;
    const JausEvent *event;
    uint8_t standing;
    uint64_t dropped;
    size_t count;
    int descriptor;

    const JausStatus statuses[] = {
        jaus_node_use_loopback(node),
        jaus_node_use_interface(node, "lo"),
        jaus_node_use_port(node, 0),
        jaus_node_use_group(node, "off"),
        jaus_node_add_peer(node, "127.0.0.1"),
        jaus_node_serve_host(node, "default"),
        jaus_node_start(node),
        jaus_node_free(node),
        jaus_component_create(node, 1, JAUS_KIND_VEHICLE, "Rover", &made),
        jaus_component_use_access_control(component, 1, 4),
        jaus_component_use_management(component, 1, 4, false),
        jaus_component_offer(component, "urn:x", 1, 0, &offered),
        jaus_component_on_standing(component, ignore_event, NULL),
        jaus_component_on_discovery(component, ignore_event, NULL),
        jaus_component_start(component),
        jaus_component_free(component),
        jaus_component_address(component, &address),
        jaus_component_standing(component, &standing, &address),
        jaus_component_next_event(component, 0, &event),
        jaus_component_descriptor(component, &descriptor),
        jaus_component_dropped_events(component, &dropped),
        jaus_component_publish(component, REPORT, sizeof REPORT),
        jaus_component_changed(component, 0x2404),
        jaus_component_set_condition(component, JAUS_CONDITION_FAILED),
        jaus_component_find(component, "urn:x", 10, &address),
        jaus_component_providers(component, "urn:x", NULL, 0, &count),
        jaus_component_query(component, peer, QUERY, sizeof QUERY, 0, 10, &message),
        jaus_component_send(component, peer, 1, REPORT, sizeof REPORT),
        jaus_component_deliver(component, peer, 1, REPORT, sizeof REPORT),
        jaus_component_set_emergency(component, peer),
        jaus_component_clear_emergency(component, peer),
        jaus_component_subscribe(component, peer, QUERY, sizeof QUERY, 0, 1, 0, NULL, NULL,
                                 &subscribed),
        jaus_component_control(component, peer, 1, NULL, NULL, &controlled),
        jaus_service_answer(service, 0x2404, answer, NULL),
        jaus_service_publish(service, 0x2404),
        jaus_service_decline(service, 0x2404),
        jaus_service_receive(service, 0x2404, NULL, NULL),
        jaus_service_configure(service, 0x2404, NULL, NULL),
        jaus_service_command(service, 0x0405, JAUS_VALIDITY_BRIEF, NULL, NULL),
        jaus_service_on_stop(service, stop, NULL),
        jaus_subscription_state(subscription, &state),
        jaus_subscription_free(subscription),
        jaus_control_watch_program(control, 500),
        jaus_control_check(control),
        jaus_control_resume(control),
        jaus_control_standby(control),
        jaus_control_send(control, 1, REPORT, sizeof REPORT),
        jaus_control_deliver(control, 1, REPORT, sizeof REPORT),
        jaus_control_free(control),
    };
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; ++i) {
        if (statuses[i] != JausStatus_InvalidHandle) {
            fprintf(stderr, "call %zu with the handle %llu: status %d\n", i, (unsigned long long)id,
                    (int)statuses[i]);
            exit(1);
        }
    }
}

static void refuse_null(JausNode node, JausComponent component, JausService service) {
    const JausAddress peer = {101, 1, 33};
    JausSubscription subscribed;
    JausComponent made;
    JausService offered;
    JausMessage message;
    size_t count;
    const JausStatus statuses[] = {
        jaus_node_create(101, 1, NULL),
        jaus_node_of_host("default", NULL),
        jaus_node_of_host(NULL, &node),
        jaus_node_use_interface(node, NULL),
        jaus_node_use_group(node, NULL),
        jaus_node_add_peer(node, NULL),
        jaus_node_serve_host(node, NULL),
        jaus_component_create(node, 1, JAUS_KIND_VEHICLE, NULL, &made),
        jaus_component_create(node, 1, JAUS_KIND_VEHICLE, "Rover", NULL),
        jaus_component_offer(component, NULL, 1, 0, &offered),
        jaus_component_offer(component, "urn:x", 1, 0, NULL),
        jaus_component_address(component, NULL),
        jaus_component_standing(component, NULL, NULL),
        jaus_component_next_event(component, 0, NULL),
        jaus_component_descriptor(component, NULL),
        jaus_component_dropped_events(component, NULL),
        jaus_component_publish(component, NULL, 2),
        jaus_component_find(component, "urn:x", 10, NULL),
        jaus_component_providers(component, NULL, NULL, 0, &count),
        jaus_component_providers(component, "urn:x", NULL, 0, NULL),
        jaus_component_query(component, peer, NULL, 4, 0, 10, &message),
        jaus_component_query(component, peer, QUERY, sizeof QUERY, 0, 10, NULL),
        jaus_component_send(component, peer, 1, NULL, 2),
        jaus_component_deliver(component, peer, 1, NULL, 2),
        jaus_component_subscribe(component, peer, NULL, 4, 0, 1, 0, NULL, NULL, &subscribed),
        jaus_component_control(component, peer, 1, NULL, NULL, NULL),
        jaus_service_answer(service, 0x2404, NULL, NULL),
        jaus_service_on_stop(service, NULL, NULL),
    };
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; ++i) {
        if (statuses[i] != JausStatus_NullPointer && statuses[i] != JausStatus_WrongState) {
            fprintf(stderr, "call %zu with null: status %d\n", i, (int)statuses[i]);
            exit(1);
        }
    }
    jaus_message_free(NULL);
}

int main(void) {
    JausNode node;
    JausComponent component;
    JausService service;
    JausAddress address;
    JausMessage message;
    int asked = 0;

    refuse(0);
    refuse(123456789);
    REQUIRE(jaus_last_error()[0] != '\0');
    REQUIRE(strlen(jaus_version()) >= 5);
    REQUIRE(jaus_log_to_stderr(0) == JausStatus_InvalidArgument);
    REQUIRE(jaus_log_to_stderr(1) == JausStatus_Ok);
    REQUIRE(jaus_log_to_stderr(1) == JausStatus_WrongState);
    REQUIRE(jaus_node_create(0, 1, &node) == JausStatus_InvalidArgument);
    REQUIRE(jaus_node_create(101, 1, &node) == JausStatus_Ok);
    REQUIRE(jaus_node_use_loopback(node) == JausStatus_Ok);
    REQUIRE(jaus_node_use_group(node, "\xFF") == JausStatus_InvalidText);
    REQUIRE(jaus_node_use_group(node, "off") == JausStatus_Ok);
    REQUIRE(jaus_node_start(node) == JausStatus_Ok);
    REQUIRE(jaus_node_start(node) == JausStatus_WrongState);
    REQUIRE(jaus_component_create(node, 0, JAUS_KIND_VEHICLE, "Rover", &component) ==
            JausStatus_InvalidArgument);
    REQUIRE(jaus_component_create(node, 44, JAUS_KIND_VEHICLE, "Rover", &component) ==
            JausStatus_Ok);
    REQUIRE(jaus_component_offer(component, "urn:jaus:jss:mobility:VelocityStateSensor", 1, 1,
                                 &service) == JausStatus_Ok);
    refuse_null(node, component, service);
    REQUIRE(jaus_component_address(component, &address) == JausStatus_WrongState);
    REQUIRE(jaus_service_publish(service, 0x4404) == JausStatus_InvalidArgument);
    REQUIRE(jaus_service_command(service, 0xD001, 9, NULL, NULL) == JausStatus_InvalidArgument);
    REQUIRE(jaus_service_answer(service, 0x2404, answer, &asked) == JausStatus_Ok);
    REQUIRE(jaus_service_decline(service, 0x24A4) == JausStatus_Ok);
    REQUIRE(jaus_component_start(component) == JausStatus_Ok);
    REQUIRE(jaus_service_decline(service, 0x24A4) == JausStatus_WrongState);
    refuse_null(node, component, service);
    REQUIRE(jaus_component_address(component, &address) == JausStatus_Ok);
    REQUIRE(address.subsystem == 101 && address.node == 1 && address.component == 44);

    REQUIRE(jaus_component_query(component, address, QUERY, sizeof QUERY, 0, 0, &message) ==
            JausStatus_Ok);
    REQUIRE(message.length == sizeof REPORT && memcmp(message.data, REPORT, sizeof REPORT) == 0);
    REQUIRE(asked == 1);
    jaus_message_free(&message);
    REQUIRE(message.data == NULL);
    jaus_message_free(&message);

    JausComponent waiting;
    struct pollfd wait;
    const JausEvent *event;
    REQUIRE(jaus_component_create(node, 1, JAUS_KIND_OTHER_SUBSYSTEM, "Watcher", &waiting) ==
            JausStatus_Ok);
    REQUIRE(jaus_component_on_discovery(waiting, NULL, NULL) == JausStatus_Ok);
    REQUIRE(jaus_component_start(waiting) == JausStatus_Ok);
    REQUIRE(jaus_component_descriptor(waiting, &wait.fd) == JausStatus_Ok);
    wait.events = POLLIN;
    REQUIRE(jaus_component_free(component) == JausStatus_Ok);
    bool is_lost = false;
    while (!is_lost) {
        REQUIRE(poll(&wait, 1, 20000) == 1);
        REQUIRE(jaus_component_next_event(waiting, 0, &event) == JausStatus_Ok);
        is_lost = event != NULL && event->kind == JausEventKind_Lost &&
                  event->source.component == 44;
    }
    REQUIRE(jaus_component_free(component) == JausStatus_InvalidHandle);
    refuse(component.id);
    REQUIRE(jaus_node_free((JausNode){waiting.id}) == JausStatus_InvalidHandle);
    REQUIRE(jaus_node_free(node) == JausStatus_Ok);
    refuse(node.id);
    refuse(waiting.id);
    return 0;
}
