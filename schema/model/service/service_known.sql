-- description: Services whose initialisation was traced. No tracepoint tells their GID.
-- grain: one row per rcl_service_init
-- when: raw.ros2_rcl_service_init
SELECT
    s.event_id, s.process_id, s.service_name, s.service_handle, s.rmw_service_handle AS rmw_handle,
    s.ts_ns AS created_ns
FROM staging.located('ros2_rcl_service_init') AS s
