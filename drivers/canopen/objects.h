#pragma once

#include <cstdint>

/// Indices of the objects used by masters and devices (CiA 301 communication profile, CiA 402 drive profile,
/// CiA 404 measuring devices, and the manufacturer area listed in docs/protocol.md).
namespace walkman::canopen::object {

inline constexpr std::uint16_t kDeviceType = 0x1000;
inline constexpr std::uint16_t kErrorRegister = 0x1001;
inline constexpr std::uint16_t kErrorField = 0x1003;
inline constexpr std::uint16_t kSyncCobId = 0x1005;
inline constexpr std::uint16_t kConsumerHeartbeat = 0x1016;
inline constexpr std::uint16_t kProducerHeartbeat = 0x1017;
inline constexpr std::uint16_t kIdentity = 0x1018;
inline constexpr std::uint16_t kSyncCounterOverflow = 0x1019;
inline constexpr std::uint16_t kErrorBehaviour = 0x1029;
inline constexpr std::uint16_t kRpdoCommunication = 0x1400;  // of RPDO1, followed by the others
inline constexpr std::uint16_t kTpdoCommunication = 0x1800;

inline constexpr std::uint16_t kImpedance = 0x2010;
inline constexpr std::uint16_t kSeriesElastic = 0x2020;
inline constexpr std::uint16_t kTemperature = 0x2030;
inline constexpr std::uint16_t kTemperatureCompact = 0x2031;
inline constexpr std::uint16_t kSensorTemperature = 0x2034;
inline constexpr std::uint16_t kCycleCounter = 0x2050;
inline constexpr std::uint16_t kPdoProtection = 0x2052;

inline constexpr std::uint16_t kAbortConnection = 0x6007;
inline constexpr std::uint16_t kErrorCode = 0x603F;
inline constexpr std::uint16_t kControlword = 0x6040;
inline constexpr std::uint16_t kStatusword = 0x6041;
inline constexpr std::uint16_t kMode = 0x6060;
inline constexpr std::uint16_t kModeDisplay = 0x6061;
inline constexpr std::uint16_t kPositionActual = 0x6064;
inline constexpr std::uint16_t kVelocityActual = 0x606C;
inline constexpr std::uint16_t kTargetTorque = 0x6071;
inline constexpr std::uint16_t kMaxTorque = 0x6072;
inline constexpr std::uint16_t kRatedTorque = 0x6076;
inline constexpr std::uint16_t kTorqueActual = 0x6077;
inline constexpr std::uint16_t kTargetPosition = 0x607A;
inline constexpr std::uint16_t kTorqueOffset = 0x60B2;
inline constexpr std::uint16_t kInterpolationPeriod = 0x60C2;
inline constexpr std::uint16_t kAdditionalPosition = 0x60E4;
inline constexpr std::uint16_t kTargetVelocity = 0x60FF;
inline constexpr std::uint16_t kSupportedModes = 0x6502;

inline constexpr std::uint16_t kDecimalDigits = 0x6132;
inline constexpr std::uint16_t kAutoTare = 0x6139;
inline constexpr std::uint16_t kTare = 0x6138;
inline constexpr std::uint16_t kProcessValueReal = 0x6130;
inline constexpr std::uint16_t kProcessValueInt16 = 0x7130;
inline constexpr std::uint16_t kMeasuringStatus = 0x6150;

}  // namespace walkman::canopen::object
