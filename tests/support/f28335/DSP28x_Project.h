/* Host stand-in for the F2833x device headers: only what the firmware touches, written from the register layout
 * (SPRUI07). Bit-fields start at bit 0, as on the C28x. EALLOW protection and write-1 bits are modelled in device.c. */
#ifndef DSP28X_PROJECT_H
#define DSP28X_PROJECT_H

#include <stdint.h>

#define __interrupt

#ifndef DSP28_DATA_TYPES
#define DSP28_DATA_TYPES
typedef uint16_t Uint16;
#endif

#define REGISTER(name, ...)                                                                                          \
    union name                                                                                                       \
    {                                                                                                                \
        uint16_t all;                                                                                                \
        struct                                                                                                       \
        {                                                                                                            \
            __VA_ARGS__                                                                                              \
        } bit;                                                                                                       \
    }

#define TB_COUNT_UP 0u
#define TB_DIV1 0u
#define TB_ENABLE 1u
#define TB_CTR_ZERO 1u
#define CC_SHADOW 0u
#define CC_IMMEDIATE 1u
#define CC_CTR_ZERO 0u
#define AQ_CLEAR 1u
#define AQ_SET 2u
#define TZ_ENABLE 1u
#define TZ_FORCE_HI 1u
#define TZ_FORCE_LO 2u
#define ET_CTR_ZERO 1u
#define ET_CTRU_CMPA 4u
#define ET_CTRU_CMPB 6u
#define ET_1ST 1u
#define ET_2ND 2u
#define ET_3RD 3u
#define M_INT3 0x0004u
#define PIEACK_GROUP3 0x0004u

struct EPWM_REGS
{
    REGISTER(TBCTL_REG, uint16_t CTRMODE : 2; uint16_t PHSEN : 1; uint16_t PRDLD : 1; uint16_t SYNCOSEL : 2;
             uint16_t SWFSYNC : 1; uint16_t HSPCLKDIV : 3; uint16_t CLKDIV : 3; uint16_t PHSDIR : 1;
             uint16_t FREE_SOFT : 2;) TBCTL;
    union
    {
        uint32_t all;
        struct
        {
            uint16_t TBPHSHR;
            uint16_t TBPHS;
        } half;
    } TBPHS;
    uint16_t TBCTR;
    uint16_t TBPRD;
    REGISTER(CMPCTL_REG, uint16_t LOADAMODE : 2; uint16_t LOADBMODE : 2; uint16_t SHDWAMODE : 1; uint16_t rsvd1 : 1;
             uint16_t SHDWBMODE : 1;) CMPCTL;
    union
    {
        uint32_t all;
        struct
        {
            uint16_t CMPAHR;
            uint16_t CMPA;
        } half;
    } CMPA;
    uint16_t CMPB;
    REGISTER(AQCTL_REG, uint16_t ZRO : 2; uint16_t PRD : 2; uint16_t CAU : 2; uint16_t CAD : 2; uint16_t CBU : 2;
             uint16_t CBD : 2;) AQCTLA;
    REGISTER(AQCTLB_REG, uint16_t ZRO : 2;) AQCTLB;
    REGISTER(DBCTL_REG, uint16_t OUT_MODE : 2; uint16_t POLSEL : 2; uint16_t IN_MODE : 2;) DBCTL;
    REGISTER(PCCTL_REG, uint16_t CHPEN : 1;) PCCTL;
    REGISTER(TZEINT_REG, uint16_t rsvd1 : 1; uint16_t CBC : 1; uint16_t OST : 1;) TZEINT;
    REGISTER(HRCNFG_REG, uint16_t EDGMODE : 2; uint16_t CTLMODE : 1; uint16_t HRLOAD : 1;) HRCNFG;
    REGISTER(AQSFRC_REG, uint16_t ACTSFA : 2; uint16_t OTSFA : 1; uint16_t ACTSFB : 2; uint16_t OTSFB : 1;
             uint16_t RLDCSF : 2;) AQSFRC;
    REGISTER(AQCSFRC_REG, uint16_t CSFA : 2; uint16_t CSFB : 2;) AQCSFRC;
    REGISTER(TZSEL_REG, uint16_t CBC : 6; uint16_t rsvd1 : 2; uint16_t OSHT1 : 1; uint16_t OSHT2 : 1;
             uint16_t OSHT3 : 1;) TZSEL;
    REGISTER(TZCTL_REG, uint16_t TZA : 2; uint16_t TZB : 2;) TZCTL;
    REGISTER(TZFLG_REG, uint16_t INT : 1; uint16_t CBC : 1; uint16_t OST : 1;) TZFLG;
    REGISTER(TZCLR_REG, uint16_t INT : 1; uint16_t CBC : 1; uint16_t OST : 1;) TZCLR;
    REGISTER(TZFRC_REG, uint16_t rsvd1 : 1; uint16_t CBC : 1; uint16_t OST : 1;) TZFRC;
    REGISTER(ETSEL_REG, uint16_t INTSEL : 3; uint16_t INTEN : 1; uint16_t rsvd1 : 4; uint16_t SOCASEL : 3;
             uint16_t SOCAEN : 1; uint16_t SOCBSEL : 3; uint16_t SOCBEN : 1;) ETSEL;
    REGISTER(ETPS_REG, uint16_t INTPRD : 2; uint16_t INTCNT : 2; uint16_t rsvd1 : 4; uint16_t SOCAPRD : 2;
             uint16_t SOCACNT : 2; uint16_t SOCBPRD : 2; uint16_t SOCBCNT : 2;) ETPS;
    REGISTER(ETCLR_REG, uint16_t INT : 1; uint16_t rsvd1 : 1; uint16_t SOCA : 1; uint16_t SOCB : 1;) ETCLR;
};

struct ADC_REGS
{
    REGISTER(ADCTRL1_REG, uint16_t rsvd1 : 4; uint16_t SEQ_CASC : 1; uint16_t SEQ_OVRD : 1; uint16_t CONT_RUN : 1;
             uint16_t CPS : 1; uint16_t ACQ_PS : 4; uint16_t SUSMOD : 2; uint16_t RESET : 1;) ADCTRL1;
    REGISTER(ADCTRL2_REG, uint16_t EPWM_SOCB_SEQ2 : 1; uint16_t rsvd1 : 1; uint16_t INT_MOD_SEQ2 : 1;
             uint16_t INT_ENA_SEQ2 : 1; uint16_t rsvd2 : 1; uint16_t SOC_SEQ2 : 1; uint16_t RST_SEQ2 : 1;
             uint16_t EXT_SOC_SEQ1 : 1; uint16_t EPWM_SOCA_SEQ1 : 1; uint16_t rsvd3 : 1; uint16_t INT_MOD_SEQ1 : 1;
             uint16_t INT_ENA_SEQ1 : 1; uint16_t rsvd4 : 1; uint16_t SOC_SEQ1 : 1; uint16_t RST_SEQ1 : 1;
             uint16_t EPWM_SOCB_SEQ : 1;) ADCTRL2;
    REGISTER(ADCTRL3_REG, uint16_t SMODE_SEL : 1; uint16_t ADCCLKPS : 4; uint16_t ADCPWDN : 1;
             uint16_t ADCBGRFDN : 2;) ADCTRL3;
    REGISTER(ADCMAXCONV_REG, uint16_t MAX_CONV1 : 4; uint16_t MAX_CONV2 : 3;) ADCMAXCONV;
    REGISTER(ADCCHSELSEQ1_REG, uint16_t CONV00 : 4; uint16_t CONV01 : 4; uint16_t CONV02 : 4; uint16_t CONV03 : 4;)
    ADCCHSELSEQ1;
    REGISTER(ADCCHSELSEQ3_REG, uint16_t CONV08 : 4; uint16_t CONV09 : 4; uint16_t CONV10 : 4; uint16_t CONV11 : 4;)
    ADCCHSELSEQ3;
    REGISTER(ADCCHSELSEQ4_REG, uint16_t CONV12 : 4; uint16_t CONV13 : 4; uint16_t CONV14 : 4; uint16_t CONV15 : 4;)
    ADCCHSELSEQ4;
    REGISTER(ADCST_REG, uint16_t INT_SEQ1 : 1; uint16_t INT_SEQ2 : 1; uint16_t SEQ1_BSY : 1; uint16_t SEQ2_BSY : 1;
             uint16_t INT_SEQ1_CLR : 1; uint16_t INT_SEQ2_CLR : 1;) ADCST;
};

struct ADC_RESULT_MIRROR_REGS
{
    uint16_t ADCRESULT0, ADCRESULT1, ADCRESULT2, ADCRESULT3, ADCRESULT4, ADCRESULT5, ADCRESULT6, ADCRESULT7;
    uint16_t ADCRESULT8, ADCRESULT9, ADCRESULT10, ADCRESULT11, ADCRESULT12, ADCRESULT13, ADCRESULT14, ADCRESULT15;
};

struct SCI_REGS
{
    REGISTER(SCICCR_REG, uint16_t SCICHAR : 3; uint16_t ADDRIDLE_MODE : 1; uint16_t LOOPBKENA : 1;
             uint16_t PARITYENA : 1; uint16_t PARITY : 1; uint16_t STOPBITS : 1;) SCICCR;
    REGISTER(SCICTL1_REG, uint16_t RXENA : 1; uint16_t TXENA : 1; uint16_t SLEEP : 1; uint16_t TXWAKE : 1;
             uint16_t rsvd1 : 1; uint16_t SWRESET : 1; uint16_t RXERRINTENA : 1;) SCICTL1;
    uint16_t SCIHBAUD;
    uint16_t SCILBAUD;
    REGISTER(SCICTL2_REG, uint16_t TXINTENA : 1; uint16_t RXBKINTENA : 1; uint16_t rsvd1 : 4; uint16_t TXEMPTY : 1;
             uint16_t TXRDY : 1;) SCICTL2;
    REGISTER(SCIRXST_REG, uint16_t rsvd : 1; uint16_t RXWAKE : 1; uint16_t PE : 1; uint16_t OE : 1; uint16_t FE : 1;
             uint16_t BRKDT : 1; uint16_t RXRDY : 1; uint16_t RXERROR : 1;) SCIRXST;
    REGISTER(SCIRXBUF_REG, uint16_t RXDT : 8; uint16_t rsvd : 6; uint16_t SCIFFPE : 1; uint16_t SCIFFFE : 1;)
    OCTETS_IN[1];
    uint16_t SCITXBUF;
    REGISTER(SCIFFTX_REG, uint16_t TXFFIL : 5; uint16_t TXFFIENA : 1; uint16_t TXFFINTCLR : 1; uint16_t TXFFINT : 1;
             uint16_t TXFFST : 5; uint16_t TXFIFOXRESET : 1; uint16_t SCIFFENA : 1; uint16_t SCIRST : 1;) SCIFFTX;
    REGISTER(SCIFFRX_REG, uint16_t RXFFIL : 5; uint16_t RXFFIENA : 1; uint16_t RXFFINTCLR : 1; uint16_t RXFFINT : 1;
             uint16_t RXFFST : 5; uint16_t RXFIFORESET : 1; uint16_t RXFFOVRCLR : 1; uint16_t RXFFOVF : 1;) SCIFFRX;
    REGISTER(SCIFFCT_REG, uint16_t FFTXDLY : 8; uint16_t rsvd1 : 5; uint16_t CDC : 1; uint16_t ABDCLR : 1;
             uint16_t ABD : 1;) SCIFFCT;
};

struct SYS_CTRL_REGS
{
    REGISTER(PLLSTS_REG, uint16_t PLLLOCKS : 1; uint16_t rsvd1 : 1; uint16_t PLLOFF : 1; uint16_t MCLKSTS : 1;
             uint16_t MCLKCLR : 1; uint16_t OSCOFF : 1; uint16_t MCLKOFF : 1; uint16_t DIVSEL : 2;) PLLSTS;
    REGISTER(HISPCP_REG, uint16_t HSPCLK : 3;) HISPCP;
    REGISTER(LOSPCP_REG, uint16_t LSPCLK : 3;) LOSPCP;
    REGISTER(PCLKCR0_REG, uint16_t rsvd1 : 2; uint16_t TBCLKSYNC : 1; uint16_t ADCENCLK : 1; uint16_t rsvd2 : 6;
             uint16_t SCIAENCLK : 1;) PCLKCR0;
    REGISTER(PLLCR_REG, uint16_t DIV : 4;) PLLCR;
    uint16_t SCSR;
    uint16_t WDCR;
};

struct GPIO_PAIRS
{
    uint16_t GPIO0 : 2, GPIO1 : 2, GPIO2 : 2, GPIO3_5 : 6, GPIO6_7 : 4, GPIO8_11 : 8, GPIO12 : 2, GPIO13 : 2, GPIO14_15 : 4;
};

struct GPIO_PAIRS_2
{
    uint16_t GPIO16_23 : 16, GPIO24_27 : 8, GPIO28 : 2, GPIO29 : 2, GPIO30_31 : 4;
};

struct GPIO_BITS
{
    uint16_t GPIO0 : 1, GPIO1 : 1, GPIO2 : 1, GPIO3_11 : 9, GPIO12 : 1, GPIO13 : 1, GPIO14_15 : 2;
    uint16_t GPIO16_27 : 12, GPIO28 : 1, GPIO29 : 1, GPIO30_31 : 2;
};

struct GPIO_CTRL_REGS
{
    union
    {
        uint16_t all[2];
        struct GPIO_PAIRS bit;
    } GPAQSEL1, GPAMUX1;
    union
    {
        uint16_t all[2];
        struct GPIO_PAIRS_2 bit;
    } GPAQSEL2, GPAMUX2;
    union
    {
        uint16_t all[2];
        struct GPIO_BITS bit;
    } GPAPUD;
};

struct GPIO_DATA_REGS
{
    union
    {
        uint16_t all[2];
        struct GPIO_BITS bit;
    } GPADAT;
};

struct PIE_CTRL_REGS
{
    REGISTER(PIEACK_REG, uint16_t ACK1 : 1; uint16_t ACK2 : 1; uint16_t ACK3 : 1;) PIEACK;
    REGISTER(PIEIER_REG, uint16_t INTx1 : 1; uint16_t INTx2 : 1;) PIEIER3;
};

struct PIE_VECT_TABLE
{
    void (*EPWM1_INT)(void);
};

extern volatile struct EPWM_REGS EPwm1Regs, EPwm2Regs;
extern volatile struct ADC_REGS AdcRegs;
extern volatile struct ADC_RESULT_MIRROR_REGS AdcMirror;
extern volatile struct SYS_CTRL_REGS SysCtrlRegs;
extern volatile struct GPIO_CTRL_REGS GpioCtrlRegs;
extern volatile struct GPIO_DATA_REGS GpioDataRegs;
extern volatile struct PIE_CTRL_REGS PieCtrlRegs;
extern volatile struct PIE_VECT_TABLE PieVectTable;
extern volatile unsigned int IER, IFR;
/* Every access goes through the model: a write to SCITXBUF moves an octet, TXFFST counts those that wait. */
#define SciaRegs (*device_scia())
volatile struct SCI_REGS *device_scia(void);
/* A read takes an octet out of the FIFO. */
#define SCIRXBUF OCTETS_IN[device_octet_in()]
unsigned device_octet_in(void);
extern Uint16 RamfuncsLoadStart, RamfuncsLoadEnd, RamfuncsRunStart;

#define EALLOW device_eallow()
#define EDIS device_edis()
#define EINT device_eint()
#define DINT device_dint()

void device_eallow(void);
void device_edis(void);
void device_eint(void);
void device_dint(void);

void InitSysCtrl(void);
void InitFlash(void);
void InitPieCtrl(void);
void InitPieVectTable(void);
void InitAdc(void);
void ServiceDog(void);
void MemCopy(Uint16 *source, Uint16 *source_end, Uint16 *destination);

#endif
