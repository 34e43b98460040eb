-- description: All links, from effect to cause.
-- grain: one row per link
SELECT
    run_id,
    to_kind AS from_kind,
    to_id AS from_id,
    from_kind AS to_kind,
    from_id AS to_id,
    link_kind
FROM derive.flow_link
