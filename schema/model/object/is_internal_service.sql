-- description: Whether a service is infrastructure of ROS: parameters, lifecycle, type description.
CREATE OR REPLACE MACRO staging.is_internal_service(service_name) AS
coalesce(
    regexp_extract(service_name, '[^/]*$') IN (
        'get_parameters', 'get_parameter_types', 'set_parameters', 'set_parameters_atomically',
        'describe_parameters', 'list_parameters', 'get_type_description',
        'change_state', 'get_state', 'get_available_states', 'get_available_transitions',
        'get_transition_graph', 'get_logger_levels', 'set_logger_levels'
    ),
    false
)
