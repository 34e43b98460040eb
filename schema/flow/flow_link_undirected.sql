-- description: All links in both directions.
-- grain: two rows per link
SELECT run_id, from_kind, from_id, to_kind, to_id, link_kind FROM derive.flow_link
UNION ALL
SELECT run_id, from_kind, from_id, to_kind, to_id, link_kind FROM derive.flow_link_reversed
