"""Symbols of callbacks as tracetools demangles them."""

from __future__ import annotations

from collections.abc import Iterator

PARAMETER_SERVICES = {
    "get_parameters": "GetParameters",
    "get_parameter_types": "GetParameterTypes",
    "set_parameters": "SetParameters",
    "set_parameters_atomically": "SetParametersAtomically",
    "describe_parameters": "DescribeParameters",
    "list_parameters": "ListParameters",
}

PARAMETER_EVENTS = (
    "rclcpp::TimeSource::NodeState::attachNode("
    "std::shared_ptr<rclcpp::node_interfaces::NodeBaseInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeTopicsInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeGraphInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeServicesInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeLoggingInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeClockInterface>, "
    "std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface>)"
    "::{lambda(std::shared_ptr<rcl_interfaces::msg::ParameterEvent_<std::allocator<void> > const>)"
    "#1}"
)

# Services of a managed node, in the order of creation.
LIFECYCLE_SERVICES = (
    "change_state",
    "get_state",
    "get_available_states",
    "get_available_transitions",
    "get_transition_graph",
)


def parameter_services() -> Iterator[tuple[str, str]]:
    """Name and callback symbol of each parameter service, in the order of creation."""
    for number, (name, message) in enumerate(PARAMETER_SERVICES.items(), start=1):
        request, response = (
            f"std::shared_ptr<rcl_interfaces::srv::{message}_{part}_<std::allocator<void> > >"
            for part in ("Request", "Response")
        )
        yield (
            name,
            "rclcpp::ParameterService::ParameterService("
            "std::shared_ptr<rclcpp::node_interfaces::NodeBaseInterface>, "
            "std::shared_ptr<rclcpp::node_interfaces::NodeServicesInterface>, "
            "rclcpp::node_interfaces::NodeParametersInterface*, rclcpp::QoS const&)"
            f"::{{lambda(std::shared_ptr<rmw_request_id_s>, {request}, {response})#{number}}}",
        )


def timer_callback(node_name: str) -> str:
    """Symbol of a timer's callback, a bound member function of the node."""
    node = _class_name(node_name)
    return f"std::_Bind<void ({node}::*({node}*))()>"


def subscription_callback(node_name: str, message_type: str) -> str:
    """Symbol of a subscription's callback, a bound member function of the node."""
    node = _class_name(node_name)
    return (
        f"std::_Bind<void ({node}::*({node}*, std::_Placeholder<1>))"
        f"(std::shared_ptr<{message_type}_<std::allocator<void> > const>)>"
    )


def service_callback(node_name: str) -> str:
    """Symbol of a service's callback, a bound member function of the node."""
    node = _class_name(node_name)
    request, response = (
        f"std::shared_ptr<std_srvs::srv::Trigger_{part}_<std::allocator<void> > >"
        for part in ("Request", "Response")
    )
    return (
        f"std::_Bind<void ({node}::*({node}*, std::_Placeholder<1>, std::_Placeholder<2>))"
        f"({request}, {response})>"
    )


def _class_name(node_name: str) -> str:
    return "".join(part.capitalize() for part in node_name.split("_")) + "Node"
