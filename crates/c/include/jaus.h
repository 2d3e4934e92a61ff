/* The C interface of jaus, a SAE JAUS node stack. SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Handles are numbers of objects: one that is zero, freed or of another type is an error, as is a null
 * pointer. Every function may be called on any thread, but for jaus_component_next_event, which one
 * thread at a time may call for a component. Functions that say "not in a callback" fail there. Texts
 * are UTF-8 and end with a 0. Messages are octets, from their message code. Arguments are copied.
 */

#ifndef JAUS_H
#define JAUS_H

/* Made by cbindgen of crates/c/src: change that, and run the test `header`. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/**
 * Can be delayed.
 */
#define JAUS_PRIORITY_LOW 0

/**
 * Nearly all messages.
 */
#define JAUS_PRIORITY_STANDARD 1

/**
 * Before ordinary traffic.
 */
#define JAUS_PRIORITY_HIGH 2

/**
 * Before everything else.
 */
#define JAUS_PRIORITY_SAFETY_CRITICAL 3

/**
 * A subsystem that moves or acts.
 */
#define JAUS_KIND_VEHICLE 10001

/**
 * An operator control unit.
 */
#define JAUS_KIND_OPERATOR_CONTROL_UNIT 20001

/**
 * A subsystem of another kind.
 */
#define JAUS_KIND_OTHER_SUBSYSTEM 30001

/**
 * Starting; cannot be controlled yet.
 */
#define JAUS_STATE_INITIALIZE 0

/**
 * Acts on the commands of the client in control.
 */
#define JAUS_STATE_READY 1

/**
 * Can be controlled, but does not act.
 */
#define JAUS_STATE_STANDBY 2

/**
 * Shutting down.
 */
#define JAUS_STATE_SHUTDOWN 3

/**
 * Something is broken.
 */
#define JAUS_STATE_FAILURE 4

/**
 * Stopped by an emergency.
 */
#define JAUS_STATE_EMERGENCY 5

/**
 * The value of `JausEventKind_ControlStatus` before the peer's first report.
 */
#define JAUS_STATE_UNKNOWN 255

/**
 * The component is ready for work, or its failure is repaired.
 */
#define JAUS_CONDITION_INITIALIZED 0

/**
 * Something is broken: the component goes to the state Failure, which ends control.
 */
#define JAUS_CONDITION_FAILED 1

/**
 * The person responsible on site has checked the vehicle: all emergencies end.
 */
#define JAUS_CONDITION_SAFE 2

/**
 * The component stops by itself, as by a stop input: an emergency begins that no client can clear.
 */
#define JAUS_CONDITION_STOPPED 3

/**
 * The reason of `JAUS_CONDITION_STOPPED` is over: its emergency ends. Those that clients have set remain.
 */
#define JAUS_CONDITION_STOP_RELEASED 4

/**
 * As the standard's commands need: 500 ms for efforts, velocities and commands of your own; vectors
 * while their client shows life; goals until they are reached.
 */
#define JAUS_VALIDITY_BY_CODE 0

/**
 * 500 ms after receipt.
 */
#define JAUS_VALIDITY_BRIEF 1

/**
 * While the client shows life at least every second.
 */
#define JAUS_VALIDITY_WHILE_ALIVE 2

/**
 * Until it is done, as long as control lasts.
 */
#define JAUS_VALIDITY_UNTIL_DONE 3

/**
 * The result of a call. `jaus_last_error` gives the reason in words.
 */
typedef enum JausStatus {
  /**
   * Success.
   */
  JausStatus_Ok = 0,
  /**
   * A required pointer is null.
   */
  JausStatus_NullPointer = 1,
  /**
   * The handle is zero, was freed, or is of another type.
   */
  JausStatus_InvalidHandle = 2,
  /**
   * A text is not valid UTF-8.
   */
  JausStatus_InvalidText = 3,
  /**
   * A value is out of range or malformed.
   */
  JausStatus_InvalidArgument = 4,
  /**
   * The call does not fit the object's state: for instance a setting after the start.
   */
  JausStatus_WrongState = 5,
  /**
   * The call waits, which is not allowed in a callback.
   */
  JausStatus_WrongThread = 6,
  /**
   * The limit of objects or of waiting requests is reached.
   */
  JausStatus_TooMany = 7,
  /**
   * The node or the component could not be started.
   */
  JausStatus_NotStarted = 8,
  /**
   * A service lacks what makes it safe: Management, a stop callback, or an answer to a query.
   */
  JausStatus_Unsafe = 9,
  /**
   * No component with the service was found in time, or it offers no such service.
   */
  JausStatus_NotFound = 10,
  /**
   * The peer did not answer in time.
   */
  JausStatus_NoAnswer = 11,
  /**
   * The message could not be sent, or its delivery is not confirmed.
   */
  JausStatus_NotSent = 12,
  /**
   * The peer refuses: control, a subscription, or a state.
   */
  JausStatus_Refused = 13,
  /**
   * Control of the peer is lost.
   */
  JausStatus_ControlLost = 14,
  /**
   * The peer is under control, but not ready for commands.
   */
  JausStatus_NotReady = 15,
  /**
   * The component or its node has stopped.
   */
  JausStatus_Stopped = 16,
  /**
   * An error in the library. The call had no effect that can be relied on.
   */
  JausStatus_Internal = 17,
} JausStatus;

/**
 * What an event is about.
 */
typedef enum JausEventKind {
  /**
   * A message for a service: `data`, from its code; `source` sent it.
   */
  JausEventKind_Message = 1,
  /**
   * What commands have started must stop, and the stop callback has been called.
   */
  JausEventKind_Stop = 2,
  /**
   * A report of the subscription `subject`: `data`, from its code. `age` is the time since its
   * arrival, `lost` counts the reports lost in transit so far.
   */
  JausEventKind_Report = 3,
  /**
   * The subscription `subject` is up. `rate` is what the peer has confirmed.
   */
  JausEventKind_SubscriptionUp = 4,
  /**
   * No reports of the subscription `subject` arrive at present; `text` has the reason. The
   * subscription goes on and tries to get them again.
   */
  JausEventKind_SubscriptionDown = 5,
  /**
   * The subscription `subject` is over; `text` has the reason.
   */
  JausEventKind_SubscriptionEnded = 6,
  /**
   * The peer `source` under the control `subject` has reported the state `value`.
   */
  JausEventKind_ControlStatus = 7,
  /**
   * The control `subject` of `source` is lost for good; `text` has the reason.
   */
  JausEventKind_ControlLost = 8,
  /**
   * This component is in the state `value` now, and `source` controls it (0.0.0: nobody).
   */
  JausEventKind_Standing = 9,
  /**
   * The services of the component `source` are known, or have changed.
   */
  JausEventKind_Found = 10,
  /**
   * The component `source` is gone.
   */
  JausEventKind_Lost = 11,
} JausEventKind;

/**
 * The answer to a query, for the time of a callback.
 */
typedef struct JausAnswer JausAnswer;

/**
 * A component.
 */
typedef struct JausComponent {
  /**
   * The number of the object; 0 is none.
   */
  uint64_t id;
} JausComponent;

/**
 * The address of a component: subsystem, node and component, such as 101.1.33. 65535 and 255 mean
 * all.
 */
typedef struct JausAddress {
  /**
   * 1 to 65534.
   */
  uint16_t subsystem;
  /**
   * 1 to 254.
   */
  uint8_t node;
  /**
   * 1 to 254.
   */
  uint8_t component;
} JausAddress;

/**
 * A message that the library has allocated. Free it with `jaus_message_free`.
 */
typedef struct JausMessage {
  /**
   * The message, from its code.
   */
  uint8_t *data;
  /**
   * The number of its octets.
   */
  size_t length;
} JausMessage;

/**
 * A node, or the connection to the node of this host.
 */
typedef struct JausNode {
  /**
   * The number of the object; 0 is none.
   */
  uint64_t id;
} JausNode;

/**
 * An event. It is valid during the callback, or until the next call of `jaus_component_next_event` or
 * the end of the component. Fields that the kind does not name are 0. New versions of the library
 * may add fields at the end.
 */
typedef struct JausEvent {
  /**
   * What it is about; determines which fields are set.
   */
  enum JausEventKind kind;
  /**
   * A state.
   */
  uint8_t value;
  /**
   * The component that the event comes from.
   */
  struct JausAddress source;
  /**
   * The id of the subscription or of the control.
   */
  uint64_t subject;
  /**
   * A message, from its code. Null if there is none.
   */
  const uint8_t *data;
  /**
   * The number of octets of `data`.
   */
  size_t length;
  /**
   * A reason for people, in UTF-8. Never null.
   */
  const char *text;
  /**
   * Seconds since the arrival.
   */
  double age;
  /**
   * Hertz; 0 for reports on change.
   */
  double rate;
  /**
   * How many reports were lost in transit.
   */
  uint64_t lost;
} JausEvent;

/**
 * Gets an event. `user` is the pointer that was given with the callback.
 *
 * A callback runs on the library's thread. It must return within 500 ms: while it runs, the whole
 * node stands still. After that time the stop callbacks of the node's components are called. It must
 * not throw.
 */
typedef void (*JausEventCallback)(void *user, const struct JausEvent *event);

/**
 * Control of a peer.
 */
typedef struct JausControl {
  /**
   * The number of the object; 0 is none.
   */
  uint64_t id;
} JausControl;

/**
 * A service of a component, before the component starts.
 */
typedef struct JausService {
  /**
   * The number of the component.
   */
  uint64_t component;
  /**
   * The place of the service among its services.
   */
  uint32_t place;
} JausService;

/**
 * Answers a query with `jaus_answer_set`, or not at all. As for `JausEventCallback`.
 */
typedef void (*JausAnswerCallback)(void *user,
                                   const struct JausEvent *query,
                                   struct JausAnswer *answer);

/**
 * Stops everything that the commands of a component have started. Also called when nothing moves.
 *
 * It runs on the library's thread or, if a callback hangs, on another one while that callback still
 * runs. It must not wait for anything that a callback holds, such as a mutex. It must not throw.
 */
typedef void (*JausStopCallback)(void *user);

/**
 * A subscription to the reports of a peer.
 */
typedef struct JausSubscription {
  /**
   * The number of the object; 0 is none.
   */
  uint64_t id;
} JausSubscription;

/**
 * The state of a subscription.
 */
typedef struct JausSubscriptionState {
  /**
   * Whether reports arrive, as far as known now.
   */
  bool is_up;
  /**
   * The rate in hertz that the peer has confirmed; 0 for reports on change.
   */
  double rate;
  /**
   * Seconds since the last report arrived; negative before the first.
   */
  double age;
  /**
   * Reports lost in transit.
   */
  uint64_t lost;
  /**
   * Reports dropped because the program was slow.
   */
  uint64_t missed;
} JausSubscriptionState;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Waits until another component is known that offers a service, in any version, for at most `timeout`
 * milliseconds (0: 10 s). Not in a callback.
 *
 * Contract:
 * `urn` is null, or a text that ends with a 0. `found` is null, or can be written.
 */
enum JausStatus jaus_component_find(struct JausComponent component,
                                    const char *urn,
                                    uint32_t timeout,
                                    struct JausAddress *found);

/**
 * Lists the known components that offer a service: at most `capacity` of them into `addresses`, and
 * how many there are into `count`. Does not wait.
 *
 * Contract:
 * `urn` is null, or a text that ends with a 0. `addresses` is null and `capacity` 0, or `capacity`
 * addresses can be written to it. `count` is null, or can be written.
 */
enum JausStatus jaus_component_providers(struct JausComponent component,
                                         const char *urn,
                                         struct JausAddress *addresses,
                                         size_t capacity,
                                         size_t *count);

/**
 * Sends a query, `length` octets from its code, and waits for the report with the code `report` (0: the
 * code that the standard's numbers give). Repeats the query until `timeout` milliseconds have passed
 * (0: 1.5 s). Not in a callback. Free the answer with `jaus_message_free`.
 *
 * Contract:
 * `data` is null, or points to `length` octets. `answer` is null, or can be written.
 */
enum JausStatus jaus_component_query(struct JausComponent component,
                                     struct JausAddress peer,
                                     const uint8_t *data,
                                     size_t length,
                                     uint16_t report,
                                     uint32_t timeout,
                                     struct JausMessage *answer);

/**
 * Frees the answer to a query, and sets it to null. Without effect if it is null.
 *
 * Contract:
 * `message` is null, or one that `jaus_component_query` has written and that was not changed.
 */
void jaus_message_free(struct JausMessage *message);

/**
 * Sends a message, `length` octets from its code, with `JAUS_PRIORITY_...`. Does not wait. Success does
 * not mean that it arrives. `destination` may have wildcards.
 *
 * Contract:
 * `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_component_send(struct JausComponent component,
                                    struct JausAddress destination,
                                    uint8_t urgency,
                                    const uint8_t *data,
                                    size_t length);

/**
 * Like `jaus_component_send`, with retransmission, and waits until the receiver acknowledges. Not in a
 * callback.
 *
 * Contract:
 * `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_component_deliver(struct JausComponent component,
                                       struct JausAddress destination,
                                       uint8_t urgency,
                                       const uint8_t *data,
                                       size_t length);

/**
 * Sets an emergency at a peer that offers Management, and waits until it reports that. The peer stops
 * until `jaus_component_clear_emergency`. This needs no control. Not in a callback.
 */
enum JausStatus jaus_component_set_emergency(struct JausComponent component,
                                             struct JausAddress peer);

/**
 * Clears an emergency that this component has set. Not in a callback.
 */
enum JausStatus jaus_component_clear_emergency(struct JausComponent component,
                                               struct JausAddress peer);

/**
 * Describes a component of a node: its number within the node, 1 to 254, the kind and the name of its
 * subsystem. Start it with `jaus_component_start`, and free it with `jaus_component_free`.
 *
 * Contract:
 * `name` is null, or a text that ends with a 0. `component` is null, or can be written.
 */
enum JausStatus jaus_component_create(struct JausNode node,
                                      uint8_t number,
                                      uint16_t kind,
                                      const char *name,
                                      struct JausComponent *component);

/**
 * Offers Access Control: only the client in control may command. Clients with an authority below
 * `authority` do not get control, which ends a quarter of `timeout` late when it is not renewed for
 * `timeout` seconds. Usual values are 1 and 4.
 */
enum JausStatus jaus_component_use_access_control(struct JausComponent component,
                                                  uint8_t authority,
                                                  uint8_t timeout);

/**
 * Offers Management, which includes Access Control: the component acts only while a client controls it
 * and has made it ready. With `initializes` it starts in the state Initialize, until
 * `jaus_component_set_condition` ends that.
 */
enum JausStatus jaus_component_use_management(struct JausComponent component,
                                              uint8_t authority,
                                              uint8_t timeout,
                                              bool initializes);

/**
 * Starts a component of a node that runs. When this fails, the component can only be freed. Not in a
 * callback.
 */
enum JausStatus jaus_component_start(struct JausComponent component);

/**
 * Requests control of a peer, and waits until it is granted. `authority` is 0 to 255; the higher one
 * wins. Control renews itself until it is freed. Not in a callback.
 *
 * Its events are `JausEventKind_ControlStatus` and `..._ControlLost`. Without a callback they are events
 * of the component.
 *
 * Contract:
 * Until the control or the component is freed, `callback` can be called with `user` on any thread.
 * `control` is null, or can be written.
 */
enum JausStatus jaus_component_control(struct JausComponent component,
                                       struct JausAddress peer,
                                       uint8_t authority,
                                       JausEventCallback callback,
                                       void *user,
                                       struct JausControl *control);

/**
 * Releases control when the program has not called a function for this control for `limit`
 * milliseconds, at least 100: the library renews control on a thread of its own, also for a program
 * that hangs. Once for each control.
 */
enum JausStatus jaus_control_watch_program(struct JausControl control, uint32_t limit);

/**
 * Checks that commands can be sent: control is held, and the peer is ready if it was resumed. Does not
 * wait.
 */
enum JausStatus jaus_control_check(struct JausControl control);

/**
 * Makes the peer act on commands, and waits until it reports that it is ready. Not in a callback.
 */
enum JausStatus jaus_control_resume(struct JausControl control);

/**
 * Puts the peer into standby, and waits until it reports that. Not in a callback.
 */
enum JausStatus jaus_control_standby(struct JausControl control);

/**
 * Sends a command, `length` octets from its code, if commands can be sent, as `jaus_control_check`
 * says. Does not wait.
 *
 * Contract:
 * `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_control_send(struct JausControl control,
                                  uint8_t urgency,
                                  const uint8_t *data,
                                  size_t length);

/**
 * Like `jaus_control_send`, with retransmission, and waits until the peer acknowledges. Not in a
 * callback.
 *
 * Contract:
 * `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_control_deliver(struct JausControl control,
                                     uint8_t urgency,
                                     const uint8_t *data,
                                     size_t length);

/**
 * Releases control and frees it. Waits for the peer's confirmation, but not in a callback.
 */
enum JausStatus jaus_control_free(struct JausControl control);

/**
 * Ends a component and frees it, with its subscriptions and control: it stops what it moves, and
 * releases what it controls. Not in a callback. Waits for callbacks that run, and 2 s at most for the
 * rest. When it returns, no callback of the component runs or will run.
 */
enum JausStatus jaus_component_free(struct JausComponent component);

/**
 * Stops a node and frees it. Its components stop what they move and release what they control; they
 * are freed, too, with their subscriptions and control. Not in a callback. Waits for callbacks that
 * run, and 2 s at most for the rest. When it returns, no callback runs or will run.
 */
enum JausStatus jaus_node_free(struct JausNode node);

/**
 * Writes the library's log to standard error from now on: 1 errors, 2 also warnings, 3 also the course of
 * events, 4 also details. Once in a process. Without this call there is no log.
 */
enum JausStatus jaus_log_to_stderr(uint8_t level);

/**
 * Creates a node with default settings: all interfaces, UDP port 3794. `subsystem` is 1 to 65534,
 * `number` 1 to 254. Start it with `jaus_node_start`, and free it with `jaus_node_free`.
 *
 * Contract:
 * `node` is null, or can be written.
 */
enum JausStatus jaus_node_create(uint16_t subsystem, uint8_t number, struct JausNode *node);

/**
 * Uses the node of this host, which another process runs, such as `jaus node --local`. `address` is
 * `default`, the path of a socket, or a port of loopback such as `127.0.0.1:37940`. Components connect
 * when they start, and again whenever the node is back.
 *
 * Contract:
 * `address` is null, or a text that ends with a 0. `node` is null, or can be written.
 */
enum JausStatus jaus_node_of_host(const char *address,
                                  struct JausNode *node);

/**
 * Keeps the node on this host, on any free port, for tests and trials.
 */
enum JausStatus jaus_node_use_loopback(struct JausNode node);

/**
 * Uses only this interface, by name or address; several calls add several.
 *
 * Contract:
 * `interface` is null, or a text that ends with a 0.
 */
enum JausStatus jaus_node_use_interface(struct JausNode node, const char *interface);

/**
 * Uses this UDP port; 0 selects any free one.
 */
enum JausStatus jaus_node_use_port(struct JausNode node, uint16_t port);

/**
 * Uses this multicast group, such as `239.255.0.1:3794`, or none (`off`).
 *
 * Contract:
 * `group` is null, or a text that ends with a 0.
 */
enum JausStatus jaus_node_use_group(struct JausNode node, const char *group);

/**
 * Also sends multicast traffic to this peer by unicast, such as `192.168.7.2:3794`.
 *
 * Contract:
 * `peer` is null, or a text that ends with a 0.
 */
enum JausStatus jaus_node_add_peer(struct JausNode node, const char *peer);

/**
 * Serves the component processes of this host at this address; see `jaus_node_of_host`.
 *
 * Contract:
 * `address` is null, or a text that ends with a 0.
 */
enum JausStatus jaus_node_serve_host(struct JausNode node, const char *address);

/**
 * Opens the links of a node. Not in a callback.
 */
enum JausStatus jaus_node_start(struct JausNode node);

/**
 * Reports each change of the component's own state and of its controller: `JausEventKind_Standing`.
 * Before the start. Without a callback they are events of the component.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_component_on_standing(struct JausComponent component,
                                           JausEventCallback callback,
                                           void *user);

/**
 * Reports components that are found and lost. Before the start. Without a callback they are events of
 * the component.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_component_on_discovery(struct JausComponent component,
                                            JausEventCallback callback,
                                            void *user);

/**
 * The address of a component that runs.
 *
 * Contract:
 * `address` is null, or can be written.
 */
enum JausStatus jaus_component_address(struct JausComponent component, struct JausAddress *address);

/**
 * The state of a component that runs, `JAUS_STATE_...`, and the client in control (0.0.0: nobody).
 *
 * Contract:
 * `state` and `controller` are null, or can be written.
 */
enum JausStatus jaus_component_standing(struct JausComponent component,
                                        uint8_t *state,
                                        struct JausAddress *controller);

/**
 * The next event of a component, or null after `timeout` milliseconds without one; a negative timeout
 * waits for ever. The event is valid until the next call, or until the component is freed, so one thread
 * at a time may call this. Fails with `JausStatus_Stopped` when the component has ended and all events
 * are fetched. Only with a timeout of 0 in a callback.
 *
 * Contract:
 * `event` is null, or can be written.
 */
enum JausStatus jaus_component_next_event(struct JausComponent component,
                                          int32_t timeout,
                                          const struct JausEvent **event);

/**
 * A descriptor that is readable while events wait, for `poll`, `select` and the like. It belongs to the
 * library: neither read nor close it. Call `jaus_component_next_event` with a timeout of 0 when it is
 * readable, until there is no event.
 *
 * Contract:
 * `descriptor` is null, or can be written.
 */
enum JausStatus jaus_component_descriptor(struct JausComponent component,
                                          int *descriptor);

/**
 * How many events were dropped because more than 1024 waited: the oldest reports first.
 *
 * Contract:
 * `count` is null, or can be written.
 */
enum JausStatus jaus_component_dropped_events(struct JausComponent component, uint64_t *count);

/**
 * Publishes a report, `length` octets from its code: queries are answered with it from now on, and
 * subscribers get it. A service must publish it, see `jaus_service_publish`. Does not wait.
 *
 * Contract:
 * `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_component_publish(struct JausComponent component,
                                       const uint8_t *data,
                                       size_t length);

/**
 * Tells subscribers of the query with this message code that its answer has changed. Does not wait.
 */
enum JausStatus jaus_component_changed(struct JausComponent component, uint16_t query);

/**
 * Sets the condition of the component, `JAUS_CONDITION_...`, which Management reports to clients. Does
 * not wait.
 */
enum JausStatus jaus_component_set_condition(struct JausComponent component,
                                             uint8_t condition);

/**
 * Offers a service. The version is that of its definition. Describe the service with the functions
 * `jaus_service_...` before the component starts; each query of a service of the standard must be
 * answered, published or declined.
 *
 * Contract:
 * `urn` is null, or a text that ends with a 0. `service` is null, or can be written.
 */
enum JausStatus jaus_component_offer(struct JausComponent component,
                                     const char *urn,
                                     uint8_t major,
                                     uint8_t minor,
                                     struct JausService *service);

/**
 * Answers queries with this message code by a callback, also for subscriptions to it.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_service_answer(struct JausService service,
                                    uint16_t query,
                                    JausAnswerCallback callback,
                                    void *user);

/**
 * Sets the answer to a query. Copies `length` octets, which begin with the code of the report.
 *
 * Contract:
 * `answer` is null, or that of the callback that runs. `data` is null, or points to `length` octets.
 */
enum JausStatus jaus_answer_set(struct JausAnswer *answer,
                                const uint8_t *data,
                                size_t length);

/**
 * Answers queries with this message code with the report that was last given to
 * `jaus_component_publish`. Until then the query has no answer.
 */
enum JausStatus jaus_service_publish(struct JausService service, uint16_t query);

/**
 * Leaves queries with this message code without an answer.
 */
enum JausStatus jaus_service_decline(struct JausService service, uint16_t query);

/**
 * Handles messages with this code from any sender. Without a callback they are events of the
 * component. Refused for commands of services that need control.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_service_receive(struct JausService service,
                                     uint16_t code,
                                     JausEventCallback callback,
                                     void *user);

/**
 * Handles messages with this code from the client in control: for commands that configure something.
 * The component needs Access Control or Management. Otherwise as `jaus_service_receive`.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_service_configure(struct JausService service,
                                       uint16_t code,
                                       JausEventCallback callback,
                                       void *user);

/**
 * Handles messages with this code from the client in control while the component is ready: for
 * commands that move something. The component needs Management, and the service a stop callback,
 * `jaus_service_on_stop`. `valid` is one of `JAUS_VALIDITY_...`; the stop callback is called when the
 * command is not repeated in time.
 *
 * Without a callback commands are events of the component. A program that does not fetch them for
 * 500 ms hangs: the stop callback is called, and the component goes to the state Failure, which ends
 * control, until the program fetches events again. While a command is in force the program must call
 * `jaus_component_next_event` at least every 500 ms even if there are none; the descriptor becomes
 * readable every 200 ms for this.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_service_command(struct JausService service,
                                     uint16_t code,
                                     uint8_t valid,
                                     JausEventCallback callback,
                                     void *user);

/**
 * Sets the callback that stops everything that commands of this service have started: at the end of a
 * command's validity, when control or readiness is lost, in an emergency, when the component ends,
 * and when a callback or the program hangs.
 *
 * Contract:
 * Until the component is freed, `callback` can be called with `user` on any thread.
 */
enum JausStatus jaus_service_on_stop(struct JausService service,
                                     JausStopCallback callback,
                                     void *user);

/**
 * Why the last call of this thread that failed did so. Never null; empty before the first failure.
 * The text is UTF-8 and valid until the next failure in this thread.
 */
const char *jaus_last_error(void);

/**
 * The version of the library, such as `0.1.0`.
 */
const char *jaus_version(void);

/**
 * Subscribes to the answers to a query, `length` octets from its code, and waits until the peer
 * confirms. `report` is the code of the report (0: as the standard's numbers give it). `rate` is in
 * hertz, 1/60 to 1092; 0 means on every change. With `least`, also in hertz, a lower confirmed rate is
 * an error. Not in a callback.
 *
 * The subscription renews itself, and survives failures of the peer, until it is freed. Its events are
 * `JausEventKind_Report`, `..._SubscriptionUp`, `..._SubscriptionDown` and `..._SubscriptionEnded`.
 * Without a callback they are events of the component.
 *
 * Contract:
 * `data` is null, or points to `length` octets. Until the subscription or the component is freed,
 * `callback` can be called with `user` on any thread. `subscription` is null, or can be written.
 */
enum JausStatus jaus_component_subscribe(struct JausComponent component,
                                         struct JausAddress peer,
                                         const uint8_t *data,
                                         size_t length,
                                         uint16_t report,
                                         double rate,
                                         double least,
                                         JausEventCallback callback,
                                         void *user,
                                         struct JausSubscription *subscription);

/**
 * The state of a subscription as of its last event.
 *
 * Contract:
 * `state` is null, or can be written.
 */
enum JausStatus jaus_subscription_state(struct JausSubscription subscription,
                                        struct JausSubscriptionState *state);

/**
 * Ends a subscription and frees it. When it returns, its callback will not be called any more, but for
 * a call that runs when this is called in it.
 */
enum JausStatus jaus_subscription_free(struct JausSubscription subscription);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* JAUS_H */
