-- description: Machines and containers. Containers of one machine share its clock, not its name.
-- grain: one row per clock and hostname
-- when: staging.placed_source
SELECT DISTINCT host_id, clock_id, hostname FROM staging.placed_source
